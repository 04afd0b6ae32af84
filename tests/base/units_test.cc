#include "base/units.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace veneer {
namespace {

static_assert(3_mm + 0.5_mm == 3.5_mm);
static_assert(4_mm * 2.5_mm == SquareMillimetres(10));
static_assert(6_mm / 3_mm == 2.0);
static_assert(-(2_px) < 1_px);
static_assert(sizeof(Millimetres) == sizeof(double));

TEST(Units, ThreeHundredDotsMakeAnInch) {
  const auto resolution = ScanResolution::from_dpi(300);
  EXPECT_DOUBLE_EQ(resolution.dpi(), 300);
  EXPECT_DOUBLE_EQ(resolution.to_px(25.4_mm).count(), 300);
  EXPECT_DOUBLE_EQ(resolution.to_mm(300_px).count(), 25.4);
}

TEST(Units, DegreesAndRadiansAgree) {
  EXPECT_DOUBLE_EQ(degrees(180).count(), kPi);
  EXPECT_DOUBLE_EQ(to_degrees(degrees(24)), 24);
}

TEST(Units, AbsDropsTheSign) {
  EXPECT_EQ(abs(-3_mm), 3_mm);
  EXPECT_EQ(abs(Pixels(2)), 2_px);
}

RC_GTEST_PROP(Units, ResolutionIsTheSameWayBack, ()) {
  const auto resolution = ScanResolution::from_dpi(*rc::gen::inRange(50, 2400));
  const Millimetres length(*rc::gen::inRange(-1000000, 1000000) / 1000.0);
  RC_ASSERT(abs(resolution.to_mm(resolution.to_px(length)) - length) < 1e-9_mm);
}

}  // namespace
}  // namespace veneer
