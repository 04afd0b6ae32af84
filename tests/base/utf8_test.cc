#include "base/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace veneer {
namespace {

TEST(Utf8, CountsWhatPeopleSee) {
  EXPECT_EQ(characters(""), 0);
  EXPECT_EQ(characters("oak"), 3);
  EXPECT_EQ(characters("Füße €"), 6);
}

TEST(Utf8, CutsBetweenCharacters) {
  const std::string text = "aü€";  // 1, 2 and 3 bytes
  EXPECT_EQ(beginning_of(text, 9), text);
  EXPECT_EQ(beginning_of(text, 6), text);
  EXPECT_EQ(beginning_of(text, 5), "aü");
  EXPECT_EQ(beginning_of(text, 4), "aü");
  EXPECT_EQ(beginning_of(text, 3), "aü");
  EXPECT_EQ(beginning_of(text, 2), "a");
  EXPECT_EQ(beginning_of(text, 0), "");
  EXPECT_EQ(beginning_of("\x80\x80\x80", 2), "") << "no text at all";
}

}  // namespace
}  // namespace veneer
