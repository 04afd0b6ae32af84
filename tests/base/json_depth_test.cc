#include "base/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace veneer {
namespace {

TEST(JsonDepth, CountsListsAndObjectsThatAreOpenAtOnce) {
  EXPECT_FALSE(nested_too_deeply("", 0));
  EXPECT_FALSE(nested_too_deeply(R"([[1],[2],{"a":[]}])", 3));
  EXPECT_TRUE(nested_too_deeply(R"([[1],[2],{"a":[]}])", 2));
  EXPECT_FALSE(nested_too_deeply(std::string(32, '[')));
  EXPECT_TRUE(nested_too_deeply(std::string(33, '{')));
}

TEST(JsonDepth, IsNotChangedByBracketsInTexts) {
  EXPECT_FALSE(nested_too_deeply(R"(["[[[[","{{{{"])", 1));
  EXPECT_TRUE(nested_too_deeply(R"(["]]]]",[[]]])", 2));
  EXPECT_TRUE(nested_too_deeply(R"(["\"]]]",[[]]])", 2)) << "an escaped quotation mark ends no text";
  EXPECT_TRUE(nested_too_deeply(R"(["\\",[[]]])", 2)) << "an escaped backslash escapes nothing";
}

}  // namespace
}  // namespace veneer
