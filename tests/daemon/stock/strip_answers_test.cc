#include "daemon/stock/strip_answers.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

Ring<PanelFrame> strip(double left, double right) {
  return {point<PanelFrame>(left, 5), point<PanelFrame>(right, 5), point<PanelFrame>(right, 95),
          point<PanelFrame>(left, 95)};
}

calib::AskedStrip asked(double left, double right, bool taken) {
  calib::AskedStrip out;
  const auto corners = strip(left, right);
  std::copy(corners.begin(), corners.end(), out.outline.begin());
  out.confidence = taken ? 0.75 : 0.25, out.taken = taken, out.reason = "it looks like the board";
  return out;
}

// Two strips that are taken, the second of which is asked about, and one that is left out.
PanelRead read() {
  PanelRead out;
  out.zones = {{1, Region<PanelFrame>(strip(5.5, 24.5)), "", 0.9},
               {2, Region<PanelFrame>(strip(30.5, 49.5)), "", 0.75}};
  out.asked = {asked(30, 50, true), asked(55, 75, false)};
  return out;
}

bool holds(const Region<PanelFrame>& region, double x, double y) { return region.contains(point<PanelFrame>(x, y)); }

TEST(StripAnswers, AStripThatWasLeftOutAndIsWoodIsGivenAndBecomesAZone) {
  PanelRead seen = read();
  seen.asked[1].round = {{point<PanelFrame>(65, 50), Millimetres(4)}};
  const auto said = answer_strips(seen, {{"strip-2"}, {}});
  ASSERT_TRUE(said.ok());
  ASSERT_THAT(said->edits, SizeIs(1));
  EXPECT_TRUE(said->edits[0].give);
  EXPECT_TRUE(holds(said->edits[0].shape, 65, 20));
  EXPECT_FALSE(holds(said->edits[0].shape, 55.2, 20)) << "the mask's margin from its side";
  EXPECT_FALSE(holds(said->edits[0].shape, 65, 52.5)) << "a screw, and the margin from it";
  EXPECT_TRUE(holds(said->edits[0].shape, 65, 53));
  ASSERT_THAT(said->zones, SizeIs(3));
  EXPECT_EQ(said->zones[2].number, 3);
  EXPECT_EQ(said->zones[2].confidence, 0.25);
  EXPECT_TRUE(holds(said->zones[2].shape, 65, 20));
}

TEST(StripAnswers, AGivenStripKeepsTheMarginsOfTheScan) {
  PanelRead seen = read();
  seen.asked[1].round = {{point<PanelFrame>(65, 50), Millimetres(4)}};
  seen.edge_margin = Millimetres(2), seen.round_margin = Millimetres(3);
  const auto said = answer_strips(seen, {{"strip-2"}, {}});
  ASSERT_TRUE(said.ok());
  ASSERT_THAT(said->edits, SizeIs(1));
  EXPECT_FALSE(holds(said->edits[0].shape, 56.8, 20));
  EXPECT_TRUE(holds(said->edits[0].shape, 57.2, 20));
  EXPECT_FALSE(holds(said->edits[0].shape, 65, 54.8));
  EXPECT_TRUE(holds(said->edits[0].shape, 65, 55.2));
}

TEST(StripAnswers, AGivenStripGivesNothingOfTheStripsBesideIt) {
  PanelRead seen = read();
  seen.asked[1] = asked(20, 75, false);  // reaches over both, and over their screws and cracks
  const auto said = answer_strips(seen, {{"strip-2"}, {}});
  ASSERT_TRUE(said.ok());
  ASSERT_THAT(said->edits, SizeIs(1));
  EXPECT_FALSE(holds(said->edits[0].shape, 22, 50));
  EXPECT_FALSE(holds(said->edits[0].shape, 40, 50));
  EXPECT_TRUE(holds(said->edits[0].shape, 27, 50));
  EXPECT_TRUE(holds(said->edits[0].shape, 65, 50));
  seen.asked[1] = asked(31, 49, false);  // all of it is another strip's
  const auto nothing = answer_strips(seen, {{"strip-2"}, {}});
  ASSERT_TRUE(nothing.ok());
  EXPECT_THAT(nothing->edits, SizeIs(0));
  EXPECT_THAT(nothing->zones, SizeIs(2));
}

TEST(StripAnswers, AStripThatWasTakenAndIsNoWoodIsWithheldAndIsNoZone) {
  const auto said = answer_strips(read(), {{}, {"strip-1"}});
  ASSERT_TRUE(said.ok());
  ASSERT_THAT(said->edits, SizeIs(1));
  EXPECT_FALSE(said->edits[0].give);
  EXPECT_NEAR(said->edits[0].shape.area().count(), 20 * 90, 1e-6);
  ASSERT_THAT(said->zones, SizeIs(1));
  EXPECT_EQ(said->zones[0].number, 1);
}

TEST(StripAnswers, WhatIsAsTheScanSawItChangesNothingButThatLaterScansAreTold) {
  const auto wood = answer_strips(read(), {{"strip-1"}, {}});
  ASSERT_TRUE(wood.ok());
  EXPECT_THAT(wood->edits, SizeIs(0)) << "it is usable, and what was left out of it stays so";
  EXPECT_THAT(wood->zones, SizeIs(2));
  const auto none = answer_strips(read(), {{}, {"strip-2"}});
  ASSERT_TRUE(none.ok());
  ASSERT_THAT(none->edits, SizeIs(1)) << "a later scan may take it for wood";
  EXPECT_FALSE(none->edits[0].give);
  EXPECT_THAT(none->zones, SizeIs(2));
}

TEST(StripAnswers, WhatIsNoWoodLeavesTheWoodOfOtherStripsAlone) {
  PanelRead seen = read();
  seen.asked[1] = asked(20, 75, false);  // reaches over both
  const auto said = answer_strips(seen, {{}, {"strip-2"}});
  ASSERT_TRUE(said.ok());
  ASSERT_THAT(said->edits, SizeIs(1));
  EXPECT_FALSE(holds(said->edits[0].shape, 22, 50));
  EXPECT_FALSE(holds(said->edits[0].shape, 40, 50));
  EXPECT_TRUE(holds(said->edits[0].shape, 65, 50));
}

TEST(StripAnswers, OnlyOfStripsThatAreAskedAboutAndOnlyOneOfBoth) {
  const auto unknown = answer_strips(read(), {{"strip-3"}, {}});
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(unknown.error().message, HasSubstr("strip-3"));
  const auto both = answer_strips(read(), {{"strip-1"}, {"strip-1"}});
  ASSERT_FALSE(both.ok());
  EXPECT_THAT(both.error().message, HasSubstr("wood and no wood"));
}

}  // namespace
}  // namespace veneer::daemon
