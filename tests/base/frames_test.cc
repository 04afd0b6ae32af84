#include "base/frames.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace veneer {
namespace {

constexpr Millimetres kClose(1e-9);

double number(double limit) { return *rc::gen::inRange(-100000, 100001) * limit / 100000; }

template <class Frame>
Point<Frame> random_point() {
  const double x = number(500), y = number(500);
  return point<Frame>(x, y);
}

template <class To, class From>
Isometry2<To, From> any_isometry() {
  return {degrees(number(360)), random_point<To>(),
          *rc::gen::arbitrary<bool>() ? Handedness::kImproper : Handedness::kProper};
}

template <class To, class From>
Affine2<To, From> any_affine() {
  Eigen::Matrix2d linear;
  linear << 1 + number(0.2), number(0.2), number(0.2), 1 + number(0.2);
  return {linear, {number(500), number(500)}};
}

TEST(Frames, AProperIsometryTurnsCounterClockwise) {
  const Isometry2<BedFrame, PanelFrame> bed_from_panel(degrees(90), point<BedFrame>(100, 50));
  EXPECT_LT(distance(bed_from_panel * point<PanelFrame>(10, 0), point<BedFrame>(100, 60)), kClose);
  EXPECT_DOUBLE_EQ(bed_from_panel.affine().determinant(), 1);
}

TEST(Frames, AnImproperIsometryMirrorsXBeforeItTurns) {
  const Isometry2<BedFrame, PanelFrame> bed_from_panel(degrees(90), point<BedFrame>(0, 0), Handedness::kImproper);
  EXPECT_LT(distance(bed_from_panel * point<PanelFrame>(10, 3), point<BedFrame>(-3, -10)), kClose);
  EXPECT_DOUBLE_EQ(bed_from_panel.affine().determinant(), -1);
}

TEST(Frames, TheDefaultMapChangesNothing) {
  EXPECT_EQ((Isometry2<BedFrame, PanelFrame>() * point<PanelFrame>(3, 4)), point<BedFrame>(3, 4));
  EXPECT_EQ((Affine2<BedFrame, PanelFrame>() * point<PanelFrame>(3, 4)), point<BedFrame>(3, 4));
}

RC_GTEST_PROP(Frames, TheInverseUndoesAnIsometryOfEitherHandedness, ()) {
  const auto bed_from_panel = any_isometry<BedFrame, PanelFrame>();
  const auto p = random_point<PanelFrame>();
  RC_ASSERT(distance(bed_from_panel.inverse() * (bed_from_panel * p), p) < kClose);
  const auto q = random_point<BedFrame>();
  RC_ASSERT(distance(bed_from_panel * (bed_from_panel.inverse() * q), q) < kClose);
}

RC_GTEST_PROP(Frames, ComposingIsometriesIsApplyingOneAfterTheOther, ()) {
  const auto bed_from_panel = any_isometry<BedFrame, PanelFrame>();
  const auto panel_from_artwork = any_isometry<PanelFrame, ArtworkFrame>();
  const auto p = random_point<ArtworkFrame>();
  const auto composed = bed_from_panel * panel_from_artwork;
  RC_ASSERT(distance(composed * p, bed_from_panel * (panel_from_artwork * p)) < kClose);
  const bool mirrored = bed_from_panel.handedness() != panel_from_artwork.handedness();
  RC_ASSERT((composed.handedness() == Handedness::kImproper) == mirrored);
}

RC_GTEST_PROP(Frames, AnIsometryKeepsDistancesAndItsDeterminantSaysItsHandedness, ()) {
  const auto bed_from_panel = any_isometry<BedFrame, PanelFrame>();
  const auto p = random_point<PanelFrame>(), q = random_point<PanelFrame>();
  RC_ASSERT(abs(distance(bed_from_panel * p, bed_from_panel * q) - distance(p, q)) < kClose);
  const double determinant = bed_from_panel.handedness() == Handedness::kImproper ? -1 : 1;
  RC_ASSERT(std::abs(bed_from_panel.affine().determinant() - determinant) < 1e-12);
}

RC_GTEST_PROP(Frames, AnIsometryAndItsAffineFormAgree, ()) {
  const auto bed_from_panel = any_isometry<BedFrame, PanelFrame>();
  const auto p = random_point<PanelFrame>();
  RC_ASSERT(distance(bed_from_panel.affine() * p, bed_from_panel * p) < kClose);
}

RC_GTEST_PROP(Frames, AffineMapsComposeAndInvert, ()) {
  const auto machine_from_bed = any_affine<MachineFrame, BedFrame>();
  const auto bed_from_panel = any_isometry<BedFrame, PanelFrame>();
  const auto p = random_point<PanelFrame>();
  const auto machine_from_panel = machine_from_bed * bed_from_panel.affine();
  RC_ASSERT(distance(machine_from_panel * p, machine_from_bed * (bed_from_panel * p)) < kClose);
  RC_ASSERT(distance(machine_from_panel.inverse() * (machine_from_panel * p), p) < 1e-8_mm);
}

RC_GTEST_PROP(Frames, AListIsMappedPointByPoint, ()) {
  const auto bed_from_panel = any_isometry<BedFrame, PanelFrame>();
  const std::vector<Point<PanelFrame>> points = {random_point<PanelFrame>(), random_point<PanelFrame>()};
  const auto mapped = bed_from_panel * points;
  RC_ASSERT(mapped.size() == 2U);
  RC_ASSERT(mapped[1] == bed_from_panel * points[1]);
}

}  // namespace
}  // namespace veneer
