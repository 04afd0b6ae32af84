#include "daemon/stock/drawn_pictures.h"

#include <gtest/gtest.h>

namespace veneer::daemon {
namespace {

TEST(DrawnPictures, AreFoundByTheirVersionAndTheOldestGiveWay) {
  const DrawnPictures drawn(100);
  EXPECT_EQ(drawn.find("a"), std::nullopt);
  drawn.keep("a", std::string(25, 'a'));
  drawn.keep("b", std::string(25, 'b'));
  drawn.keep("c", std::string(25, 'c'));
  drawn.keep("d", std::string(25, 'd'));
  EXPECT_EQ(drawn.find("a"), std::string(25, 'a'));
  drawn.keep("e", std::string(25, 'e'));
  EXPECT_EQ(drawn.find("b"), std::nullopt) << "nobody had asked for it for the longest time";
  EXPECT_EQ(drawn.find("a"), std::string(25, 'a'));
  EXPECT_EQ(drawn.find("e"), std::string(25, 'e'));
  drawn.keep("a", "anew");
  EXPECT_EQ(drawn.find("a"), "anew");
  drawn.keep("large", std::string(50, 'l'));
  EXPECT_EQ(drawn.find("large"), std::string(50, 'l'));
  drawn.keep("huge", std::string(51, 'h'));
  EXPECT_EQ(drawn.find("huge"), std::nullopt) << "it would leave no room for others";
}

// A cell at rest takes no room for what somebody looked at in the morning.
TEST(DrawnPictures, AreGivenUpWhenNobodyHasAskedForThem) {
  const DrawnPictures drawn;
  drawn.keep("a", "first");
  drawn.keep("b", "second");
  const auto kept = std::chrono::steady_clock::now();
  EXPECT_FALSE(drawn.forget_unasked(kept - std::chrono::seconds(60)));
  while (std::chrono::steady_clock::now() == kept) {
  }
  EXPECT_EQ(drawn.find("a"), "first") << "and so it was asked for later than the other";
  EXPECT_TRUE(drawn.forget_unasked(kept + std::chrono::nanoseconds(1)));
  EXPECT_EQ(drawn.find("b"), std::nullopt);
  EXPECT_EQ(drawn.find("a"), "first");
}

}  // namespace
}  // namespace veneer::daemon
