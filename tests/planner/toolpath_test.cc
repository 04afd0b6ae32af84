#include "planner/toolpath.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "base/polygon_ops.h"
#include "planner/cut_order.h"

namespace veneer::planner {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAreArray;

Ring<BedFrame> square(double x, double y, double side) {
  return {point<BedFrame>(x, y), point<BedFrame>(x + side, y), point<BedFrame>(x + side, y + side),
          point<BedFrame>(x, y + side)};
}

ToolpathOptions options_with_kerf(double mm) {
  ToolpathOptions options;
  options.recipe.kerf = Millimetres(mm);
  return options;
}

std::vector<ToolpathPiece> grid_of_pieces(int columns, int rows) {
  std::vector<ToolpathPiece> pieces;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      pieces.push_back({PieceId{r * columns + c + 1}, square(20 + 15 * c, 20 + 15 * r, 13), {}, "A1-2", degrees(90)});
  return pieces;
}

std::vector<std::pair<long, long>> micrometres(const std::vector<Point<BedFrame>>& points) {
  std::vector<std::pair<long, long>> out;
  for (const auto& p : points) out.emplace_back(std::lround(p.x.count() * 1000), std::lround(p.y.count() * 1000));
  return out;
}

// Whole micrometres, the repeated first point left out.
auto corners(const ToolpathStroke& stroke) { return micrometres({stroke.path.begin(), stroke.path.end() - 1}); }

auto exactly(const Ring<BedFrame>& ring) { return UnorderedElementsAreArray(micrometres(ring)); }

TEST(Toolpath, GrowsASquareByExactlyHalfAKerf) {
  const auto path = make_toolpath({{PieceId{1}, square(10, 20, 12), {}, "", {}}}, options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->strokes, SizeIs(1));
  const auto& cut = path->strokes[0];
  EXPECT_TRUE(cut.closed);
  EXPECT_EQ(cut.path.front(), cut.path.back());
  EXPECT_THAT(corners(cut), exactly(square(9.865, 19.865, 12.27)));
}

TEST(Toolpath, GrowsAnLShapeByExactlyHalfAKerfInItsNotchToo) {
  const Ring<BedFrame> l = {point<BedFrame>(0, 0), point<BedFrame>(20, 0), point<BedFrame>(20, 8),
                            point<BedFrame>(8, 8), point<BedFrame>(8, 20), point<BedFrame>(0, 20)};
  const auto path = make_toolpath({{PieceId{1}, l, {}, "", {}}}, options_with_kerf(0.3));
  ASSERT_TRUE(path.ok());
  const Ring<BedFrame> grown = {point<BedFrame>(-.15, -.15),  point<BedFrame>(20.15, -.15),
                                point<BedFrame>(20.15, 8.15), point<BedFrame>(8.15, 8.15),
                                point<BedFrame>(8.15, 20.15), point<BedFrame>(-.15, 20.15)};
  EXPECT_THAT(corners(path->strokes[0]), exactly(grown));
}

TEST(Toolpath, ShrinksHolesAndCutsThemBeforeTheOutline) {
  const auto path =
      make_toolpath({{PieceId{1}, square(0, 0, 40), {square(10, 10, 20)}, "", {}}}, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->strokes, SizeIs(2));
  EXPECT_THAT(corners(path->strokes[0]), exactly(square(10.1, 10.1, 19.8)));
  EXPECT_THAT(corners(path->strokes[1]), exactly(square(-0.1, -0.1, 40.2)));
}

TEST(Toolpath, BurnsPiecesInAHoleBeforeThePieceAroundThem) {
  std::vector<ToolpathPiece> pieces = {{PieceId{1}, square(0, 0, 40), {square(10, 10, 20)}, "", {}},
                                       {PieceId{2}, square(14, 14, 12), {}, "", {}}};
  const auto path = make_toolpath(pieces, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  EXPECT_THAT(path->order, testing::ElementsAre(PieceId{2}, PieceId{1}));
}

TEST(Toolpath, EngravesTheMarkBeforeCuttingThePieceFree) {
  const auto path = make_toolpath(grid_of_pieces(4, 3), options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  EXPECT_THAT(path->warnings, IsEmpty());
  std::set<PieceId> seen, cut_free;
  PieceId last{};
  for (const auto& stroke : path->strokes) {
    if (stroke.piece != last) {
      EXPECT_TRUE(seen.insert(stroke.piece).second) << "strokes of a piece are adjacent";
      last = stroke.piece;
    }
    EXPECT_FALSE(cut_free.contains(stroke.piece)) << "nothing is burnt into a piece that is already loose";
    if (stroke.role == ToolpathRole::kCut) cut_free.insert(stroke.piece);
  }
  EXPECT_THAT(cut_free, SizeIs(12));
}

TEST(Toolpath, WarnsAboutAMarkThatDoesNotFitAndStillCuts) {
  const auto path = make_toolpath({{PieceId{9}, square(0, 0, 5), {}, "A10-12", degrees(90)}}, options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->warnings, SizeIs(1));
  EXPECT_THAT(path->warnings[0], HasSubstr("A10-12"));
  EXPECT_THAT(path->strokes, SizeIs(1));
}

TEST(Toolpath, RefusesOutlinesThatEncloseNothing) {
  const Ring<BedFrame> flat = {point<BedFrame>(0, 0), point<BedFrame>(10, 0), point<BedFrame>(20, 0)};
  const auto path = make_toolpath({{PieceId{7}, flat, {}, "A1-1", degrees(90)}}, options_with_kerf(0.27));
  ASSERT_FALSE(path.ok());
  EXPECT_EQ(path.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(path.error().message, HasSubstr("A1-1"));
}

TEST(Toolpath, StartsACutAtACorner) {
  Ring<BedFrame> with_points_on_edges;
  for (int i = 0; i < 4; ++i) {
    const auto corner = square(0, 0, 10);
    const auto &a = corner[static_cast<std::size_t>(i)], &b = corner[static_cast<std::size_t>((i + 1) % 4)];
    with_points_on_edges.push_back(a);
    with_points_on_edges.push_back(
        point<BedFrame>((a.x + b.x).count() / 2, (a.y + b.y).count() / 2 - (i == 0 ? .1 : 0)));
  }
  auto options = options_with_kerf(0.2);
  options.start = point<BedFrame>(5, -3);  // nearest to the slight bend in the middle of the lower edge
  const auto path = make_toolpath({{PieceId{1}, with_points_on_edges, {}, "", {}}}, options);
  ASSERT_TRUE(path.ok());
  const auto& start = path->strokes[0].path.front();
  EXPECT_GT(std::abs(start.x.count() - 5), 4.5);
}

TEST(Toolpath, EstimatesMoreTimeThanLengthOverSpeed) {
  const auto path = make_toolpath(grid_of_pieces(5, 5), options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  const double plain = 25 * 4 * 13.27 / 15;
  EXPECT_GT(path->estimate.count(), plain);
  EXPECT_LT(path->estimate.count(), 1.5 * plain);
}

TEST(CutOrder, BeatsRowByRow) {
  std::vector<CutSite> sites;
  std::vector<std::size_t> rows;
  for (int r = 0; r < 12; ++r)
    for (int c = 0; c < 20; ++c) {
      rows.push_back(sites.size());
      sites.push_back({point<BedFrame>(20 + 15 * c, 20 + 15 * r), {}});
    }
  const auto start = point<BedFrame>(0, 0);
  const auto order = cut_order(sites, start);
  EXPECT_LT(tour_length(sites, order, start).count(), 0.6 * tour_length(sites, rows, start).count());
  // A grid cannot be visited in less than a step per site.
  EXPECT_LT(tour_length(sites, order, start).count(), 1.05 * (239 * 15 + std::hypot(20, 20)));
}

RC_GTEST_PROP(CutOrder, VisitsEverySiteOnceAndKeepsItsDemands, ()) {
  const auto n = static_cast<std::size_t>(*rc::gen::inRange(0, 40));
  std::vector<CutSite> sites;
  for (std::size_t i = 0; i < n; ++i) {
    sites.push_back({point<BedFrame>(*rc::gen::inRange(0, 500), *rc::gen::inRange(0, 300)), {}});
    // Demands only on later indices: no cycles.
    if (i > 0 && *rc::gen::inRange(0, 4) == 0)
      sites[static_cast<std::size_t>(*rc::gen::inRange(0, static_cast<int>(i)))].after.push_back(i);
  }
  const auto order = cut_order(sites, point<BedFrame>(0, 0));
  RC_ASSERT(std::set<std::size_t>(order.begin(), order.end()).size() == n);
  RC_ASSERT(order.size() == n);
  std::set<std::size_t> done;
  for (const std::size_t i : order) {
    for (const std::size_t before : sites[i].after) RC_ASSERT(done.contains(before));
    done.insert(i);
  }
  RC_ASSERT(order == cut_order(sites, point<BedFrame>(0, 0)));
}

TEST(CutOrder, SurvivesDemandsThatGoInACircle) {
  std::vector<CutSite> sites = {
      {point<BedFrame>(0, 0), {1}}, {point<BedFrame>(1, 0), {2}}, {point<BedFrame>(2, 0), {0}}};
  EXPECT_THAT(cut_order(sites, point<BedFrame>(0, 0)), SizeIs(3));
}

RC_GTEST_PROP(Toolpath, LeavesThePieceWholeAndTheKerfInItsBand, ()) {
  // A star of random radii: any simple outline.
  const int n = *rc::gen::inRange(3, 12);
  Ring<BedFrame> outline;
  for (int i = 0; i < n; ++i) {
    const double r = *rc::gen::inRange(60, 150) / 10.0;
    outline.push_back(point<BedFrame>(100 + r * std::cos(2 * kPi * i / n), 100 + r * std::sin(2 * kPi * i / n)));
  }
  const double kerf = 0.27;
  const auto path = make_toolpath({{PieceId{1}, outline, {}, "", {}}}, options_with_kerf(kerf));
  RC_ASSERT(path.ok());
  const Region<BedFrame> piece(outline);
  const auto band = subtract(offset(piece, Millimetres(kerf + 0.003)), offset(piece, Millimetres(-0.003)));
  const auto swept = [&](const Point<BedFrame>& p) { return band.contains(p); };
  for (const auto& p : path->strokes[0].path) RC_ASSERT(swept(p));
}

}  // namespace
}  // namespace veneer::planner
