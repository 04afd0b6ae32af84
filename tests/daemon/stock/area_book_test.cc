#include "daemon/stock/area_book.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>

#include "daemon/stock/pixel_coverage.h"

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
    AreaBook book = opened(panel, usable_of_panel(mask, width, height));
    for (const auto& allocation : wood) enter(book, booked_wood(allocation, mask, panel), allocation.state);
    return book;
  }
};

// A star of up to seven corners about a place: what pieces look like, and worse.
Ring<PanelFrame> star(double x, double y, double radius) {
  Ring<PanelFrame> out;
  const int corners = *rc::gen::inRange(3, 8);
  for (int i = 0; i < corners; ++i) {
    const double r = radius * *rc::gen::inRange(30, 101) / 100, turn = 2 * std::numbers::pi * i / corners;
    out.push_back(point<PanelFrame>(x + r * std::cos(turn), y + r * std::sin(turn)));
  }
  return out;
}

// Patches of wood with holes; one piece in each field of 5 x 5 mm at most, some of them across the panel's border.
Scene any_scene() {
  Scene scene;
  const auto rectangles = *rc::gen::inRange(0, 6);
  for (int i = 0; i < rectangles; ++i) {
    const cv::Rect place{*rc::gen::inRange(0, kColumns), *rc::gen::inRange(0, kRows), *rc::gen::inRange(1, kColumns),
                         *rc::gen::inRange(1, kRows)};
    scene.mask.pixels(place & cv::Rect(0, 0, kColumns, kRows)) = *rc::gen::element(0, 1, 255);
  }
  for (double x = 2.5; x < 25; x += 5)
    for (double y = 2.5; y < 20; y += 5) {
      if (!*rc::gen::arbitrary<bool>()) continue;
      auto& allocation = scene.wood.emplace_back();
      const auto shape = star(x, y, 2.2);
      const Region<PanelFrame> outline(shape);
      allocation.state = *rc::gen::elementOf(std::vector(std::begin(kLive), std::end(kLive)));
      allocation.area = offset(outline, 0.1_mm);
      if (*rc::gen::arbitrary<bool>()) allocation.outline = shape;  // else it was written off
      allocation.area = intersect(allocation.area, Region<PanelFrame>(rectangle(x - 2.5, y - 2.5, 5, 5)));
    }
  return scene;
}

double sum(const AreaBook& b) {
  return (b.free + b.reserved + b.cut + b.kerf + b.suspect + b.scrap + b.unusable).count();
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

// Each class again, with polygons and without the others, so that none is what the others leave over.
RC_GTEST_PROP(AreaBook, EachClassIsWhatItsPolygonsSay, ()) {
  const Scene scene = any_scene();
  const AreaBook book = scene.book();
  const Region<PanelFrame> panel(rectangle(0, 0, scene.width.count(), scene.height.count()));
  std::vector<Region<PanelFrame>> pixels;
  for (int row = 0; row < kRows; ++row)
    for (int from = 0, column = 0; column <= kColumns; ++column)
      if (column == kColumns || scene.mask.pixels.at<unsigned char>(row, column) == 0) {
        if (column > from)
          pixels.emplace_back(rectangle(from * kPixel, (kRows - row - 1) * kPixel, (column - from) * kPixel, kPixel));
        from = column + 1;
      }
  const auto usable = intersect(unite(pixels), panel);
  std::vector<Region<PanelFrame>> all, held, cut, kerf, suspect, scrap;
  for (const auto& a : scene.wood) {
    const Region<PanelFrame> outline(a.outline);
    all.push_back(a.area);
    if (is_held(a.state)) held.push_back(a.area);
    if (a.state == AllocationState::kCut) cut.push_back(intersect(outline, a.area));
    if (a.state == AllocationState::kCut) kerf.push_back(subtract(a.area, outline));
    if (a.state == AllocationState::kSuspect) suspect.push_back(a.area);
    if (a.state == AllocationState::kScrap) scrap.push_back(a.area);
  }
  const auto within = [&](const std::vector<Region<PanelFrame>>& areas) {
    return intersect(unite(areas), panel).area().count();
  };
  // Where lines cross, polygons are rounded to a micrometre.
  const double rounding = 1e-3 + 1e-5 * panel.area().count();
  const auto near = [&](SquareMillimetres is, double should_be) { return std::abs(is.count() - should_be) < rounding; };
  const auto booked = unite(all);
  RC_ASSERT(near(book.panel, panel.area().count()));
  RC_ASSERT(near(book.free, subtract(usable, booked).area().count()));
  RC_ASSERT(near(book.unusable, subtract(subtract(panel, usable), booked).area().count()));
  RC_ASSERT(near(book.reserved, within(held)));
  RC_ASSERT(near(book.cut, within(cut)));
  RC_ASSERT(near(book.kerf, within(kerf)));
  RC_ASSERT(near(book.suspect, within(suspect)));
  RC_ASSERT(near(book.scrap, within(scrap)));
  RC_ASSERT(std::abs(sum(book) - book.panel.count()) < 1e-6 * book.panel.count());
}

// And by points, a raster of 0.05 mm, that knows neither polygons' nor pixels' areas.
RC_GTEST_PROP(AreaBook, EachClassIsWhatPointsSay, ()) {
  const Scene scene = any_scene();
  const AreaBook book = scene.book();
  constexpr double kStep = 0.05;
  std::map<std::string, int> points;
  const int columns = static_cast<int>(std::lround(scene.width.count() / kStep));
  const int rows = static_cast<int>(std::lround(scene.height.count() / kStep));
  struct Booked {
    const db::AllocationRecord* record;
    Region<PanelFrame> outline;
    int field_x, field_y;  // the 5 mm that it lies in
  };
  std::vector<Booked> wood;
  for (const auto& a : scene.wood) {
    if (a.area.empty()) continue;
    const auto corner = a.area.rings().front().front();
    wood.push_back({&a, Region<PanelFrame>(a.outline), static_cast<int>(corner.x.count() / 5.0001),
                    static_cast<int>(corner.y.count() / 5.0001)});
  }
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const auto p = point<PanelFrame>((column + 0.5) * kStep, (row + 0.5) * kStep);
      const char* what = nullptr;
      for (const auto& [a, outline, field_x, field_y] : wood) {
        if (static_cast<int>(p.x.count() / 5) != field_x || static_cast<int>(p.y.count() / 5) != field_y) continue;
        if (!a->area.contains(p)) continue;
        what = a->state == AllocationState::kSuspect ? "suspect"
               : a->state == AllocationState::kScrap ? "scrap"
               : a->state != AllocationState::kCut   ? "reserved"
               : outline.contains(p)                 ? "cut"
                                                     : "kerf";
      }
      if (what == nullptr) {
        const int x = static_cast<int>(p.x.count() / kPixel), y = kRows - 1 - static_cast<int>(p.y.count() / kPixel);
        what = scene.mask.pixels.at<unsigned char>(y, x) != 0 ? "free" : "unusable";
      }
      ++points[what];
    }
  const double allowed = 1e-3 * book.panel.count();
  for (const auto& [name, area] : {std::pair{"free", book.free},
                                   {"reserved", book.reserved},
                                   {"cut", book.cut},
                                   {"kerf", book.kerf},
                                   {"suspect", book.suspect},
                                   {"scrap", book.scrap},
                                   {"unusable", book.unusable}}) {
    if (std::abs(points[name] * kStep * kStep - area.count()) >= allowed)
      RC_FAIL(std::string(name) + ": " + std::to_string(points[name] * kStep * kStep) + " by points, " +
              std::to_string(area.count()) + " in the book");
  }
}

}  // namespace
}  // namespace veneer::daemon
