#include "planner/drawings/line_settings.h"

#include <gmock/gmock.h>

namespace veneer::planner {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

DrawnLine line(const std::string& layer, const std::string& colour) {
  DrawnLine out;
  out.points = {{1, 2}, {4, 6}};
  out.layer = layer, out.colour = colour;
  return out;
}

Drawing drawing() {
  Drawing out;
  out.lines = {line("cut", "#ff0000"), line("", "#0000ff"), line("cut", "#ff0000"), line("", "")};
  return out;
}

TEST(LineSettings, ALayersWordCountsBeforeItsColoursAndBothBeforeWhatIsSaidOfAll) {
  const auto settings =
      settings_of(drawing(), {0.1, 10.0, 1, {}}, {{"#ff0000", {0.2, 20.0, {}, {}}}, {"cut", {0.3, {}, {}, {}}}});
  ASSERT_TRUE(settings.ok());
  EXPECT_EQ(settings->at(0).power, 0.3);
  EXPECT_EQ(settings->at(0).speed_mm_s, 20.0);
  EXPECT_EQ(settings->at(0).passes, 1);
  EXPECT_EQ(settings->at(1).power, 0.1);
}

TEST(LineSettings, WhatTheDrawingLacksIsRefusedByName) {
  const auto settings = settings_of(drawing(), {}, {{"#00ff00", {0.2, 20.0, {}, {}}}});
  ASSERT_FALSE(settings.ok());
  EXPECT_THAT(settings.error().message, HasSubstr("#00ff00"));
}

TEST(LineSettings, ARecipeFillsOnlyWhatNobodySaidOfItsLayer) {
  auto settings = settings_of(drawing(), {}, {{"cut", {0.3, {}, {}, {}}}});
  ASSERT_TRUE(settings.ok());
  fill_from_recipes(drawing(), {{"cut", {0.85, 15.0, 3, true}}}, *settings);
  EXPECT_EQ(settings->at(0).power, 0.3);
  EXPECT_EQ(settings->at(0).speed_mm_s, 15.0);
  EXPECT_FALSE(settings->at(0).passes.has_value() || settings->at(0).air.has_value());
}

// A line is told once both are: power alone, or speed alone, burns nothing.
TEST(LineSettings, WhatNobodySaysIsNamedByItsLayerElseItsColour) {
  auto settings = settings_of(drawing(), {}, {{"cut", {0.3, {}, {}, {}}}, {"#0000ff", {{}, 20.0, {}, {}}}});
  ASSERT_TRUE(settings.ok());
  EXPECT_THAT(untold(drawing(), *settings), ElementsAre("#0000ff", "cut", "lines without layer and colour"));
  for (LineSetting& its : *settings) its.power = 0.5, its.speed_mm_s = 5;
  EXPECT_TRUE(untold(drawing(), *settings).empty());
}

TEST(LineSettings, KindsStandInTheDrawingsOrder) {
  const DrawnLineKinds kinds = kinds_of(drawing());
  ASSERT_EQ(kinds.kinds.size(), 3U);
  EXPECT_EQ(kinds.kinds[0].layer, "cut");
  EXPECT_EQ(kinds.kinds[0].lines, 2U);
  EXPECT_NEAR(kinds.kinds[0].length_mm, 10, 1e-12);
  EXPECT_THAT(kinds.of_line, ElementsAre(0, 1, 0, 2));
}

TEST(LineSettings, BothOrNoneOfACornersCoordinatesMoveIt) {
  EXPECT_THAT(move_to_corner(drawing(), 10, 20), ElementsAre(9, 18));
  EXPECT_THAT(move_to_corner(drawing(), {}, {}), ElementsAre(0, 0));
  EXPECT_THAT(moved({1.00004, 2.00006}, {0, 0}), ElementsAre(1.0, 2.0001));
}

}  // namespace
}  // namespace veneer::planner
