#include "daemon/stock/area_book.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>

#include "daemon/stock/pixel_coverage.h"
#include "tests/daemon/stock/judged_book.h"

namespace veneer::daemon {
namespace {

using db::AllocationState;

constexpr AllocationState kLive[] = {AllocationState::kLeased, AllocationState::kReserved, AllocationState::kCutting,
                                     AllocationState::kCut,    AllocationState::kSuspect,  AllocationState::kScrap};
bool is_held(AllocationState state) {
  return state == AllocationState::kLeased || state == AllocationState::kReserved || state == AllocationState::kCutting;
}

Ring<PanelFrame> rectangle(double x, double y, double width, double height) {
  return {point<PanelFrame>(x, y), point<PanelFrame>(x + width, y), point<PanelFrame>(x + width, y + height),
          point<PanelFrame>(x, y + height)};
}

// A pixel is a quarter of a millimetre, so that its corners are whole micrometres and polygons can be as exact.
constexpr double kPixel = 0.25;
constexpr int kColumns = 80, kRows = 60;

struct Scene {
  Raster<PanelFrame> mask{cv::Mat::zeros(kRows, kColumns, CV_8UC1), ScanResolution{1 / kPixel}};
  Millimetres width{19.9}, height{14.8};  // a little less than the mask: it was rounded up to whole pixels
  std::vector<db::AllocationRecord> wood;

  AreaBook book() const {
    const auto panel = whole_panel(width, height);
    AreaBook book = opened(panel, masked_panel(mask, width, height));
    for (const auto& allocation : wood) enter(book, booked_wood(allocation, mask, panel), allocation.state);
    return book;
  }
};

double micrometres(double mm) { return std::round(mm * 1000) / 1000; }

// A star of up to seven corners about a place: what pieces look like, and worse.
Ring<PanelFrame> star(double x, double y, double radius) {
  Ring<PanelFrame> out;
  const int corners = *rc::gen::inRange(3, 8);
  for (int i = 0; i < corners; ++i) {
    const double r = radius * *rc::gen::inRange(30, 101) / 100, turn = 2 * std::numbers::pi * i / corners;
    out.push_back(point<PanelFrame>(micrometres(x + r * std::cos(turn)), micrometres(y + r * std::sin(turn))));
  }
  return out;
}

// Patches of wood with holes; one piece in each field of 5 x 5 mm at most, which begin `inset` mm within the panel: at
// 0 some lie across its border. Shapes are of whole micrometres, as the ledger keeps them, some of them with a lead-in
// or burnt around a spot that is free.
Scene any_scene(double inset) {
  Scene scene;
  const auto rectangles = *rc::gen::inRange(0, 6);
  for (int i = 0; i < rectangles; ++i) {
    const cv::Rect place{*rc::gen::inRange(0, kColumns), *rc::gen::inRange(0, kRows), *rc::gen::inRange(1, kColumns),
                         *rc::gen::inRange(1, kRows)};
    scene.mask.pixels(place & cv::Rect(0, 0, kColumns, kRows)) = *rc::gen::element(0, 1, 255);
  }
  const double last_x = inset > 0 ? scene.width.count() - inset - 2.5 : 25;
  const double last_y = inset > 0 ? scene.height.count() - inset - 2.5 : 20;
  for (double x = inset + 2.5; x < last_x; x += 5)
    for (double y = inset + 2.5; y < last_y; y += 5) {
      if (!*rc::gen::arbitrary<bool>()) continue;
      auto& allocation = scene.wood.emplace_back();
      const auto shape = star(x, y, 2.2);
      allocation.state = *rc::gen::elementOf(std::vector(std::begin(kLive), std::end(kLive)));
      allocation.area = offset(Region<PanelFrame>(shape), 0.1_mm);
      if (*rc::gen::arbitrary<bool>()) {
        allocation.outline = shape;
        const auto corner = shape.front();
        const auto lead_in = rectangle(corner.x.count() - 0.05, corner.y.count() - 0.05, 0.1, 0.9);
        if (*rc::gen::arbitrary<bool>()) allocation.area = unite(allocation.area, Region<PanelFrame>(lead_in));
      } else {  // it was written off
        allocation.area = subtract(allocation.area, Region<PanelFrame>(rectangle(x - 0.3, y - 0.2, 0.5, 0.6)));
      }
      allocation.area = intersect(allocation.area, Region<PanelFrame>(rectangle(x - 2.5, y - 2.5, 5, 5)));
    }
  return scene;
}

TEST(AreaBook, SquareCoversWhatItCoversOfEachPixel) {
  const Raster<PanelFrame> grid{cv::Mat::zeros(4, 4, CV_8UC1), ScanResolution{1}};
  const auto coverage = pixel_coverage(Region<PanelFrame>(rectangle(0.5, 1.25, 2, 1.5)), grid);
  EXPECT_EQ(coverage.column, 0);
  EXPECT_EQ(coverage.row, 1);
  const double expected[2][3] = {{0.375, 0.75, 0.375}, {0.375, 0.75, 0.375}};
  ASSERT_EQ(coverage.covered.size(), cv::Size(3, 2));
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 3; ++column)
      EXPECT_NEAR(coverage.covered.at<double>(row, column), expected[row][column], 1e-12) << row << ", " << column;
}

TEST(AreaBook, NothingCoversNothing) {
  const Raster<PanelFrame> grid{cv::Mat::zeros(4, 4, CV_8UC1), ScanResolution{1}};
  EXPECT_TRUE(pixel_coverage(Region<PanelFrame>(), grid).covered.empty());
}

TEST(AreaBook, APieceMovesFromClassToClass) {
  Scene scene;
  scene.mask.pixels(cv::Rect(0, 0, 40, 60)) = 255;  // the left 10 mm
  auto& piece = scene.wood.emplace_back();
  piece.outline = rectangle(8, 5, 4, 4);
  piece.area = Region<PanelFrame>(rectangle(7.5, 4.5, 5, 5));
  const double all = 19.9 * 14.8;
  for (const auto state : kLive) {
    piece.state = state;
    const AreaBook book = scene.book();
    EXPECT_NEAR(book.panel.count(), all, 1e-9);
    EXPECT_NEAR(book.free.count(), 10 * 14.8 - 2.5 * 5, 1e-9);
    EXPECT_NEAR(book.unusable.count(), 9.9 * 14.8 - 2.5 * 5, 1e-9);
    const bool held = is_held(state);
    EXPECT_NEAR(book.reserved.count(), held ? 25 : 0, 1e-9);
    EXPECT_NEAR(book.cut.count(), state == AllocationState::kCut ? 16 : 0, 1e-9);
    EXPECT_NEAR(book.kerf.count(), state == AllocationState::kCut ? 9 : 0, 1e-9);
    EXPECT_NEAR(book.suspect.count(), state == AllocationState::kSuspect ? 25 : 0, 1e-9);
    EXPECT_NEAR(book.scrap.count(), state == AllocationState::kScrap ? 25 : 0, 1e-9);
  }
  piece.state = AllocationState::kReleased;
  EXPECT_NEAR(scene.book().free.count(), 148, 1e-9);
}

// Each class again, with polygons and by points, and without the others, so that none is what the others leave over.
RC_GTEST_PROP(AreaBook, EachClassIsWhatPolygonsAndPointsSay, ()) {
  const Scene scene = any_scene(1);
  RC_ASSERT(judged(scene.book(), scene.wood, scene.mask, scene.width, scene.height, true) == "");
}

// Wood across the border of the panel has corners there which are rounded to a micrometre.
RC_GTEST_PROP(AreaBook, SoItIsWhereWoodLiesAcrossTheBorder, ()) {
  const Scene scene = any_scene(0);
  const auto book = plain_book(scene.book());
  const auto wood = plain_wood(scene.wood);
  const testing::PlainMask mask{scene.mask.pixels, kPixel};
  const double width = scene.width.count(), height = scene.height.count();
  const double rounding = 1e-3 + 1e-5 * width * height;
  RC_ASSERT(testing::disagreement(book, testing::count_areas(wood, mask, width, height), rounding) == "");
  RC_ASSERT(testing::disagreement_by_points(book, wood, mask, width, height) == "");
}

}  // namespace
}  // namespace veneer::daemon
