#include "drivers/sim/world.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>
#include <set>

#include "base/units.h"
#include "tests/support/temp_directory.h"

namespace veneer::sim {
namespace {

using ::testing::HasSubstr;

TwinSettings coarse(std::uint64_t seed = 1) {
  TwinSettings settings;
  settings.seed = seed;
  settings.sheet_dpi = 120;
  return settings;
}

std::unique_ptr<World> world_in(const std::filesystem::path& dir, const TwinSettings& settings = coarse()) {
  Result<std::unique_ptr<World>> world = World::open(settings, dir, make_null_logger());
  EXPECT_TRUE(world.ok()) << world.error().message;
  return std::move(*world);
}

// A beam along a path in MachineFrame mm, told in the controller's coordinates (negative, from the switches).
void burn(World& world, const std::vector<Vec2>& path, double energy_per_mm) {
  TimePoint at{};
  for (std::size_t i = 1; i < path.size(); ++i) {
    BurnSegment segment;
    segment.from = {path[i - 1].x - 520, path[i - 1].y - 380};
    segment.to = {path[i].x - 520, path[i].y - 380};
    segment.power_seconds = energy_per_mm * segment.length_mm();
    segment.start = at;
    segment.end = at += std::chrono::milliseconds(500);
    world.burn(segment);
  }
  world.flush_burns();
}

constexpr double kCut = 0.85 / 15, kEngrave = 0.20 / 80;

TEST(World, CutsWithTheDefaultRecipeAndEngravesWithTheOther) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_board("W", 200, 150).ok());
  ASSERT_TRUE(world->place_at({"W", SheetFace::kBack, {0, true, {300, 100}}, 0}, Spot::kBed).ok());
  burn(*world, {{150, 150}, {170, 150}}, kCut);
  burn(*world, {{150, 160}, {170, 160}}, kEngrave);
  burn(*world, {{150, 170}, {170, 170}}, 1e-5);
  const auto sheet = *world->sheet("W");
  ASSERT_EQ(sheet->burns.size(), 2U);
  EXPECT_EQ(sheet->burns[0].depth, BurnDepth::kThrough);
  EXPECT_EQ(sheet->burns[0].face, SheetFace::kBack);
  EXPECT_GE(sheet->burns[0].width_mm, 0.24);
  EXPECT_LE(sheet->burns[0].width_mm, 0.30);
  EXPECT_EQ(sheet->burns[1].depth, BurnDepth::kEngrave);
}

// What the beam gives while an axis takes up its play, a few hundredths of a millimetre, heats the whole spot.
TEST(World, AWornDriveEngravesAndDoesNotCutWhereItTurns) {
  const testing::TempDirectory dir;
  TwinSettings settings = coarse();
  settings.rough.backlash_mm = 0.02, settings.rough.belt_wave_mm = 0.01;
  const auto world = world_in(dir.path(), settings);
  ASSERT_TRUE(world->new_board("W", 200, 150).ok());
  ASSERT_TRUE(world->place_at({"W", SheetFace::kBack, {0, true, {300, 100}}, 0}, Spot::kBed).ok());
  // Strokes of 0.05 to 1 mm that turn by all angles, as those of letters do.
  std::vector<Vec2> path = {{160, 150}};
  for (int i = 0; i < 2000; ++i) {
    const double angle = 2.399963 * i * (1 + i % 7), length = 0.05 + 0.19 * (i % 6);
    const Vec2 next = path.back() + Vec2{std::cos(angle), std::sin(angle)} * length;
    path.push_back({std::clamp(next.x, 150.0, 170.0), std::clamp(next.y, 140.0, 160.0)});
  }
  burn(*world, path, kEngrave);
  const auto engraved = *world->sheet("W");
  ASSERT_FALSE(engraved->burns.empty());
  for (const TrueBurn& one : engraved->burns) EXPECT_EQ(one.depth, BurnDepth::kEngrave);
  // One that really stays burns a hole.
  BurnSegment rest;
  rest.from = rest.to = {155 - 520, 150 - 380};
  rest.power_seconds = 0.20 * 0.1;
  rest.end = rest.start + std::chrono::milliseconds(100);
  world->burn(rest);
  world->flush_burns();
  EXPECT_EQ((*world->sheet("W"))->burns.back().depth, BurnDepth::kThrough);
}

// Whoever asks at a job's end need not wait until the last stroke is on the disk.
TEST(World, SumsUpTheStrokeThatIsBeingBurntToo) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_board("W", 200, 150).ok());
  ASSERT_TRUE(world->place_at({"W", SheetFace::kBack, {0, true, {300, 100}}, 0}, Spot::kBed).ok());
  BurnSegment segment;
  segment.from = {150 - 520, 150 - 380}, segment.to = {170 - 520, 150 - 380};
  segment.power_seconds = kCut * segment.length_mm();
  segment.end = segment.start + std::chrono::milliseconds(500);
  world->burn(segment);
  const BurnSummary open = world->burn_summary().at(0);
  EXPECT_EQ(open.strokes, 1U);
  EXPECT_NEAR(open.through_mm, 20, 0.5);
  world->flush_burns();
  EXPECT_EQ(world->burn_summary().at(0).strokes, 1U);
  EXPECT_EQ(world->burn_summary().at(0).through_mm, open.through_mm);
}

TEST(World, PutsBurnsWhereTheAxesTrulyGoAndTheSheetTrulyLies) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_board("W", 200, 150).ok());
  const SheetPose pose{degrees(3).count(), true, {320, 110}};
  ASSERT_TRUE(world->place_at({"W", SheetFace::kBack, pose, 0}, Spot::kBed).ok());
  burn(*world, {{180, 150}, {200, 150}, {200, 170}}, kCut);
  const auto sheet = *world->sheet("W");
  ASSERT_EQ(sheet->burns.size(), 1U);
  ASSERT_EQ(sheet->burns[0].points.size(), 3U);
  const MachineAxes axes = world->axes();
  EXPECT_NE(axes.x_scale, 0);
  const Vec2 bed{(1 + axes.x_scale) * 200 + axes.skew * 150, (1 + axes.y_scale) * 150};
  const Vec2 expected = pose.back_to_sheet(bed);
  EXPECT_NEAR(sheet->burns[0].points[1].x, expected.x, 1e-9);
  EXPECT_NEAR(sheet->burns[0].points[1].y, expected.y, 1e-9);
}

TEST(World, JoinsTheBitsOfAStraightStroke) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_board("W", 200, 150).ok());
  ASSERT_TRUE(world->place_at({"W", SheetFace::kShow, {0, false, {100, 100}}, 0}, Spot::kBed).ok());
  std::vector<Vec2> path;
  for (int i = 0; i <= 100; ++i) path.push_back({150 + 0.1 * i, 150 + 0.07 * i});
  path.push_back({160, 165});
  burn(*world, path, kCut);
  const auto sheet = *world->sheet("W");
  ASSERT_EQ(sheet->burns.size(), 1U);
  EXPECT_EQ(sheet->burns[0].points.size(), 3U);
}

TEST(World, DriftsWhenTold) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  const double before = world->axes().x_scale;
  world->drift_axes(0.003);
  EXPECT_NEAR(world->axes().x_scale, before + 0.003, 1e-15);
  const auto again = world_in(dir.path());
  EXPECT_NEAR(again->axes().x_scale, before + 0.003, 1e-15);
}

TEST(World, SurvivesItsOwnRestart) {
  const testing::TempDirectory dir;
  auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_panel("P", 200, 140, 0).ok());
  ASSERT_TRUE(world->new_board("W", 100, 80).ok());
  ASSERT_TRUE(world->place("W", Spot::kScanner, SheetFace::kShow, "whole", 0).ok());
  ASSERT_TRUE(world->place("P", Spot::kBed, SheetFace::kBack, "whole", 0).ok());
  burn(*world, {{240, 180}, {260, 180}, {260, 200}, {240, 200}, {240, 180}}, kCut);
  EXPECT_EQ(world->next_picture("capture"), 1);
  const auto before = *world->snapshot(Spot::kBed);
  const double kerf = world->truth().kerf_mm;
  world.reset();

  world = world_in(dir.path(), coarse(99));  // the seed it was begun with stays
  EXPECT_EQ(world->truth().kerf_mm, kerf);
  EXPECT_EQ(world->truth().settings.seed, 1U);
  const auto after = *world->snapshot(Spot::kBed);
  EXPECT_EQ(after.placement.sheet, "P");
  EXPECT_EQ(after.placement.pose.angle_rad, before.placement.pose.angle_rad);
  EXPECT_EQ(after.placement.pose.shift, before.placement.pose.shift);
  EXPECT_EQ(cv::norm(before.sheet->material, after.sheet->material, cv::NORM_INF), 0);
  EXPECT_EQ(world->snapshot(Spot::kScanner)->placement.sheet, "W");
  EXPECT_EQ(world->next_picture("capture"), 2);
  ASSERT_TRUE(world->lift(Spot::kBed).ok());
  EXPECT_EQ((*world->sheet("P"))->pieces.size(), 1U);
  // New tags begin after the old ones.
  ASSERT_TRUE(world->new_panel("Q", 200, 140, 0).ok());
  std::set<int> ids;
  for (const char* name : {"P", "Q"}) {
    const std::shared_ptr<const Sheet> sheet = *world->sheet(name);
    for (const TrueTag& tag : sheet->tags) EXPECT_TRUE(ids.insert(tag.id).second) << tag.id;
  }
}

TEST(World, KeepsPlacedSheetsWithinGlassAndBedAndPartsOverlapping) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_board("L", 420, 280).ok());
  ASSERT_TRUE(world->new_board("S", 290, 210).ok());
  const auto inside = [](Vec2 p, double w, double h) {
    return p.x > -0.01 && p.y > -0.01 && p.x < w + 0.01 && p.y < h + 0.01;
  };
  for (int i = 0; i < 25; ++i) {
    const SheetFace face = i % 2 == 0 ? SheetFace::kShow : SheetFace::kBack;
    ASSERT_TRUE(world->place("S", Spot::kScanner, face, "whole", 0).ok());
    const SheetPose small = world->snapshot(Spot::kScanner)->placement.pose;
    EXPECT_EQ(small.mirrored, face == SheetFace::kBack);
    for (const Vec2 p : {Vec2{0, 0}, Vec2{290, 0}, Vec2{0, 210}, Vec2{290, 210}})
      EXPECT_TRUE(inside(small.place(p), 320, 300));
    ASSERT_TRUE(world->place("L", Spot::kBed, face, "whole", 0).ok());
    const SheetPose bed = world->snapshot(Spot::kBed)->placement.pose;
    for (const Vec2 p : {Vec2{0, 0}, Vec2{420, 0}, Vec2{0, 280}, Vec2{420, 280}})
      EXPECT_TRUE(inside(bed.place(p), 520, 380));
    for (const char* part : {"left", "right"}) {
      ASSERT_TRUE(world->place("L", Spot::kScanner, face, part, 0).ok());
      const SheetPose pose = world->snapshot(Spot::kScanner)->placement.pose;
      // At least 300 mm from that side of the face are on the glass, so both parts share 180 mm.
      const bool from_zero = (std::string(part) == "left") == (face == SheetFace::kShow);
      const double near = from_zero ? 0 : 420, far = from_zero ? 300 : 120;
      for (const Vec2 p : {Vec2{near, 0}, Vec2{near, 280}, Vec2{far, 0}, Vec2{far, 280}}) {
        EXPECT_TRUE(inside(pose.place(p), 320, 300)) << part << " " << i;
      }
    }
  }
}

TEST(World, NudgesALittle) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  ASSERT_TRUE(world->new_board("W", 200, 150).ok());
  EXPECT_EQ(world->nudge().error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(world->place("W", Spot::kBed, SheetFace::kBack, "whole", 0).ok());
  const SheetPose before = world->snapshot(Spot::kBed)->placement.pose;
  ASSERT_TRUE(world->nudge().ok());
  const double moved = length(world->snapshot(Spot::kBed)->placement.pose.shift - before.shift);
  EXPECT_GT(moved, 0.5);
  EXPECT_LT(moved, 6);
}

TEST(World, RefusesInOneSentenceThatNamesTheThing) {
  const testing::TempDirectory dir;
  const auto world = world_in(dir.path());
  EXPECT_THAT(world->place("P", Spot::kBed, SheetFace::kBack, "whole", 0).error().message, HasSubstr("no sheet P"));
  EXPECT_EQ(world->lift(Spot::kBed).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(world->new_board("../W", 100, 100).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(world->new_board("", 100, 100).error().code, ErrorCode::kInvalidArgument);
  ASSERT_TRUE(world->new_board("W", 420, 280).ok());
  EXPECT_EQ(world->new_board("W", 100, 100).error().code, ErrorCode::kConflict);
  EXPECT_THAT(world->place("W", Spot::kScanner, SheetFace::kShow, "whole", 0).error().message,
              HasSubstr("left and right"));
  EXPECT_EQ(world->place("W", Spot::kScanner, SheetFace::kShow, "middle", 0).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(world->place("W", Spot::kBed, SheetFace::kShow, "whole", -3).error().code, ErrorCode::kInvalidArgument);
  ASSERT_TRUE(world->new_grid("G").ok());
  EXPECT_EQ(world->new_grid("H").error().code, ErrorCode::kConflict);
}

}  // namespace
}  // namespace veneer::sim
