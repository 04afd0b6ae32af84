#include "calib/reconcile.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::Difference;
using calib::DifferenceKind;

using Outline = std::vector<cv::Point2d>;

std::vector<Region<PanelFrame>> regions_of(const std::vector<Outline>& outlines) {
  std::vector<Region<PanelFrame>> all;
  for (const auto& outline : outlines) {
    Ring<PanelFrame> ring;
    for (const auto& p : outline) ring.push_back(point<PanelFrame>(p.x, p.y));
    all.emplace_back(ring);
  }
  return all;
}
Region<PanelFrame> region_of(const Outline& outline) { return regions_of({outline}).front(); }

struct Shelf {
  rendered::Panel panel = rendered::sample_panel(140, 104, 8);
  calib::PanelFiducials fiducials;

  Shelf() {
    for (const auto& tag : panel.tags) fiducials.tags.push_back({tag.id, tag.face, tag.corners()});
    for (const auto& hole : panel.holes)
      fiducials.holes.push_back({point<PanelFrame>(hole.x, hole.y), Millimetres(hole.diameter)});
  }
  Raster<PanelFrame> map(const std::vector<Outline>& gone, double shift_mm = 0, std::uint64_t seed = 7) const {
    rendered::Panel cut = panel;
    cut.gone = gone;
    rendered::Scanner scanner;
    scanner.dpi = 150, scanner.width_mm = panel.width, scanner.height_mm = panel.height;
    scanner.optics.seed = seed;
    Raster<PanelFrame> map;
    map.resolution = scanner.nominal();
    map.pixels =
        scan_panel(cut, Face::kShow, rendered::lay(0, panel.height, shift_mm, shift_mm, 0, Face::kShow), scanner);
    map.origin = point<PanelFrame>(0, panel.height - map.height().count());
    return map;
  }
};

const Outline kLight = {{30, 30}, {42, 30}, {42, 44}, {30, 44}};  // in the lightest strip
const Outline kDark = {{72, 40}, {84, 41}, {83, 52}, {73, 51}};   // in the darkest strip
const Outline kBetween = {{52, 60}, {62, 60}, {57, 70}};

TEST(Reconcile, FindsNothingWhenTheLedgerIsRight) {
  const Shelf shelf;
  const auto found =
      reconcile(shelf.map({}), shelf.map({kLight, kDark}, 0.05, 9), regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->differences.empty());
  EXPECT_NEAR(found->gone.count(), unite(regions_of({kLight, kDark})).area().count(), 15);
}

TEST(Reconcile, FindsWoodThatIsGoneButNotBooked) {
  const Shelf shelf;
  const auto found =
      reconcile(shelf.map({}), shelf.map({kLight, kDark, kBetween}, 0, 9), regions_of({kLight}), shelf.fiducials);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->differences.size(), 2U);
  EXPECT_EQ(found->differences[0].kind, DifferenceKind::kGoneNotBooked);
  EXPECT_NEAR(found->differences[0].area.count(), region_of(kDark).area().count(), 8);
  EXPECT_TRUE(region_of(kDark).contains(found->differences[0].place));
  EXPECT_NEAR(found->differences[1].area.count(), region_of(kBetween).area().count(), 8);
  EXPECT_TRUE(region_of(kBetween).contains(found->differences[1].place));
}

// What is written off is what is gone, not the box around it.
TEST(Reconcile, TellsTheShapeOfWhatIsGone) {
  const Shelf shelf;
  const Outline corner = {{30, 30}, {44, 30}, {44, 33}, {33, 33}, {33, 46}, {30, 46}};
  const auto found = reconcile(shelf.map({}), shelf.map({corner}, 0, 9), {}, shelf.fiducials);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->differences.size(), 1U);
  const auto& shape = found->differences[0].shape;
  EXPECT_NEAR(shape.area().count(), found->differences[0].area.count(), 2);
  EXPECT_LT(subtract(shape, offset(region_of(corner), Millimetres(0.4))).area().count(), 0.1);
  EXPECT_LT(subtract(offset(region_of(corner), Millimetres(-0.4)), shape).area().count(), 0.1);
}

TEST(Reconcile, FindsBookedWoodThatIsStillThere) {
  const Shelf shelf;
  const auto found = reconcile(shelf.map({}), shelf.map({kLight}, 0, 9), regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->differences.size(), 1U);
  EXPECT_EQ(found->differences[0].kind, DifferenceKind::kBookedNotGone);
  EXPECT_TRUE(region_of(kDark).contains(found->differences[0].place));
}

TEST(Reconcile, CountsWhatWasGoneBeforeOnlyOnce) {
  const Shelf shelf;
  const auto found =
      reconcile(shelf.map({kLight}), shelf.map({kLight, kDark}, 0, 9), regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok());
  EXPECT_TRUE(found->differences.empty());
  const auto unknown = reconcile(shelf.map({kLight}), shelf.map({kLight}, 0, 9), {}, shelf.fiducials);
  ASSERT_TRUE(unknown.ok());
  EXPECT_TRUE(unknown->differences.empty());
}

TEST(Reconcile, ForgivesABorderWithinToleranceAndNoMore) {
  const Shelf shelf;
  const auto grown = offset(region_of(kLight), Millimetres(0.15), Corners::kMitred);
  const auto fine = reconcile(shelf.map({}), shelf.map({kLight}, 0, 9), {grown}, shelf.fiducials);
  ASSERT_TRUE(fine.ok());
  EXPECT_TRUE(fine->differences.empty());
  const auto shrunk = offset(region_of(kLight), Millimetres(-1.2), Corners::kMitred);
  const auto off = reconcile(shelf.map({}), shelf.map({kLight}, 0, 9), {shrunk}, shelf.fiducials);
  ASSERT_TRUE(off.ok());
  EXPECT_FALSE(off->differences.empty());
}

TEST(Reconcile, ForgivesTheWebBetweenTwoPiecesWhoseBookingsTouch) {
  const Shelf shelf;
  const Outline left = {{30, 30}, {41.85, 30}, {41.85, 44}, {30, 44}},
                right = {{42.15, 30}, {54, 30}, {54, 44}, {42.15, 44}};
  const Outline booked_left = {{29.85, 29.85}, {42, 29.85}, {42, 44.15}, {29.85, 44.15}};
  const Outline booked_right = {{42, 29.85}, {54.15, 29.85}, {54.15, 44.15}, {42, 44.15}};
  for (const std::uint64_t seed : {9, 10}) {
    const auto found = reconcile(shelf.map({}), shelf.map({left, right}, 0, seed),
                                 regions_of({booked_left, booked_right}), shelf.fiducials);
    ASSERT_TRUE(found.ok());
    EXPECT_TRUE(found->differences.empty()) << found->differences.front().area.count() << " mm2";
  }
}

TEST(Reconcile, TellsHowMuchOfAPieceIsGone) {
  const Shelf shelf;
  const auto found = reconcile(shelf.map({}), shelf.map({kLight, kBetween}, 0.05, 9), {}, shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const auto gone = [&](const Outline& outline) {
    return calib::share_gone(found->gone_mask, region_of(outline), 0.5_mm);
  };
  EXPECT_GT(gone(kLight), 0.98);
  EXPECT_LT(gone(kDark), 0.01);
  EXPECT_NEAR(gone({{36, 30}, {48, 30}, {48, 44}, {36, 44}}), 0.5, 0.06) << "half of it lies in the hole";
  EXPECT_EQ(gone({{30, 30}, {30.8, 30}, {30.8, 44}, {30, 44}}), 0) << "it has no inside";
  EXPECT_EQ(gone({{900, 30}, {912, 30}, {912, 44}, {900, 44}}), 0) << "beside the panel";
}

TEST(Reconcile, RefusesMapsThatDoNotCoverTheSameArea) {
  const Shelf shelf;
  const auto map = shelf.map({});
  auto moved = map;
  moved.origin.x += Millimetres(1);
  EXPECT_FALSE(reconcile(map, moved, {}, shelf.fiducials).ok());
  moved.pixels = cv::Mat();
  EXPECT_FALSE(reconcile(map, moved, {}, shelf.fiducials).ok());
}

}  // namespace
}  // namespace veneer
