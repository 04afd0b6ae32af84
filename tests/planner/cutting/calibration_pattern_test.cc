#include "planner/cutting/calibration_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <utility>

namespace veneer::planner {
namespace {

PatternLayout over(double width, double height, RingSpacing spacing = RingSpacing::kUneven) {
  PatternLayout options;
  options.spacing = spacing;
  options.area.add(point<MachineFrame>(30, 20));
  options.area.add(point<MachineFrame>(30 + width, 20 + height));
  return options;
}

bool is_key(const PatternRing& ring) { return ring.diameter.count() > 6; }

// The rings of an area of 440 x 320 mm fill it up to its margin; how far apart their columns are in the mean.
double mean_pitch(RingSpacing spacing) {
  const auto pattern = make_pattern(over(440, 320, spacing));
  if (!pattern) return 0;
  EXPECT_EQ(pattern->rings.size(), static_cast<std::size_t>(pattern->columns * pattern->rows));
  Box<MachineFrame> centres;
  for (const auto& ring : pattern->rings) centres.add(ring.centre);
  EXPECT_NEAR(centres.width().count(), 428, 1e-9);
  EXPECT_NEAR(centres.height().count(), 308, 1e-9);
  return centres.width().count() / (pattern->columns - 1);
}

TEST(Pattern, SpreadsItsRingsOverTheWholeArea) {
  EXPECT_NEAR(mean_pitch(RingSpacing::kEven), 40, 5);
  EXPECT_NEAR(mean_pitch(RingSpacing::kUneven), 24, 3);
}

// Holds the rings of an area against what comes again with a turn of a pulley, 30 to 52 mm.
void expect_many_phases(double width, double height, double most) {
  const auto pattern = make_pattern(over(width, height));
  ASSERT_TRUE(pattern.ok());
  for (double turn = 30; turn <= 52; turn += 0.5) {
    for (const bool along_x : {true, false}) {
      double cosines = 0, sines = 0;
      for (const auto& ring : pattern->rings) {
        const double phase = 2 * kPi * (along_x ? ring.centre.x : ring.centre.y).count() / turn;
        cosines += std::cos(phase), sines += std::sin(phase);
      }
      EXPECT_LT(std::hypot(cosines, sines) / static_cast<double>(pattern->rings.size()), most)
          << width << " x " << height << ": " << turn << " mm, " << along_x;
    }
  }
}

// No such turn leaves the rings at one phase: an error that comes again with it is seen.
TEST(Pattern, MeetsWhateverComesAgainAtManyPhases) {
  for (double width = 190; width <= 600; width += 30)
    for (double height = 190; height <= 460; height += 30) expect_many_phases(width, height, 0.5);
  expect_many_phases(420, 206, 0.4);  // the twin's board
}

// A board that was burnt before is read by the pattern that was burnt into it.
TEST(Pattern, OfEvenSpacingIsAsItWasBurntBefore) {
  const auto pattern = make_pattern(over(440, 320, RingSpacing::kEven));
  ASSERT_TRUE(pattern.ok());
  ASSERT_EQ(pattern->columns, 12);
  ASSERT_EQ(pattern->rows, 9);
  for (std::size_t i = 0; i < pattern->rings.size(); ++i) {
    const std::size_t column = i % 12, row = i / 12;
    EXPECT_NEAR(pattern->rings[i].centre.x.count(), 36 + static_cast<double>(column) * 428 / 11, 1e-9);
    EXPECT_NEAR(pattern->rings[i].centre.y.count(), 26 + static_cast<double>(row) * 308 / 8, 1e-9);
  }
  EXPECT_NEAR(pattern->kerf_lines[0].from.x.count(), 36 + 5.5 * 428 / 11 - 10, 1e-9);
  EXPECT_NEAR(pattern->kerf_lines[0].from.y.count(), 26 + 308.0 / 16 - 10.5, 1e-9);
}

TEST(Pattern, HasKeyRingsThatNoTurnOrMirroringMapsOntoThemselves) {
  const auto pattern = make_pattern(over(200, 200));
  ASSERT_TRUE(pattern.ok());
  const auto n = pattern->columns;
  ASSERT_EQ(n, pattern->rows) << "a square lattice is the hardest case";
  const auto key_at = [&](int c, int r) { return is_key(pattern->rings[static_cast<std::size_t>(r * n + c)]); };
  for (int turn = 0; turn < 4; ++turn) {
    for (const bool mirrored : {false, true}) {
      if (turn == 0 && !mirrored) continue;
      int matching = 0;
      for (int r = 0; r < n; ++r) {
        for (int c = 0; c < n; ++c) {
          int x = mirrored ? n - 1 - c : c, y = r;
          for (int t = 0; t < turn; ++t) std::tie(x, y) = std::pair(n - 1 - y, x);
          matching += key_at(c, r) && key_at(x, y) ? 1 : 0;
        }
      }
      EXPECT_LT(matching, 3) << "turn " << turn << " mirrored " << mirrored;
    }
  }
}

TEST(Pattern, KeepsKerfLinesFiveMillimetresClearOfAllElse) {
  for (const auto& [side, spacing] : {std::pair{93.0, RingSpacing::kUneven},
                                      {100, RingSpacing::kUneven},
                                      {155, RingSpacing::kUneven},
                                      {300, RingSpacing::kUneven},
                                      {460, RingSpacing::kUneven},
                                      {83, RingSpacing::kEven},
                                      {300, RingSpacing::kEven}}) {
    const auto pattern = make_pattern(over(side, side, spacing));
    ASSERT_TRUE(pattern.ok()) << side;
    ASSERT_EQ(pattern->kerf_lines.size(), 8U);
    for (const auto& line : pattern->kerf_lines) {
      EXPECT_NEAR(distance(line.from, line.to).count(), 20, 1e-9);
      for (int i = 0; i <= 40; ++i) {
        const double t = i / 40.0;
        const auto p = point<MachineFrame>(line.from.x.count() + t * (line.to.x - line.from.x).count(),
                                           line.from.y.count() + t * (line.to.y - line.from.y).count());
        for (const auto& ring : pattern->rings)
          EXPECT_GE(distance(p, ring.centre).count() - ring.diameter.count() / 2, 5 - 1e-9);
      }
    }
  }
}

TEST(Pattern, StaysInsideItsAreaAndBurnsRingsBeforeLines) {
  const auto options = over(460, 330);
  const auto pattern = make_pattern(options);
  ASSERT_TRUE(pattern.ok());
  Recipe recipe;
  recipe.engrave_speed = MmPerSecond(77), recipe.cut_speed = MmPerSecond(11), recipe.cut_power = PowerFraction(0.66);
  const auto strokes = pattern_strokes(*pattern, recipe);
  ASSERT_EQ(strokes.size(), pattern->rings.size() + pattern->kerf_lines.size());
  bool through_seen = false;
  for (const auto& stroke : strokes) {
    const bool through = stroke.speed == recipe.cut_speed;
    EXPECT_TRUE(through || !through_seen);
    EXPECT_EQ(stroke.power, through ? recipe.cut_power : recipe.engrave_power);
    EXPECT_EQ(stroke.role, StrokeRole::kPattern);
    through_seen |= through;
    for (const auto& p : stroke.path) EXPECT_TRUE(options.area.contains(p));
  }
  EXPECT_TRUE(through_seen);
}

TEST(Pattern, RefusesAnAreaTooSmallForIt) {
  EXPECT_FALSE(make_pattern(over(80, 200)).ok());
  // Room for 3 rows, but its axes would not be taken from rings that lie so close together.
  for (const double narrow : {62.0, 80.0, 92.0}) {
    EXPECT_FALSE(make_pattern(over(200, narrow)).ok()) << narrow;
    EXPECT_FALSE(make_pattern(over(narrow, 200)).ok()) << narrow;
  }
  EXPECT_TRUE(make_pattern(over(93, 93)).ok());
  EXPECT_TRUE(make_pattern(over(83, 83, RingSpacing::kEven)).ok()) << "that was burnt before is read";
  EXPECT_FALSE(make_pattern(PatternLayout{}).ok());
}

}  // namespace
}  // namespace veneer::planner
