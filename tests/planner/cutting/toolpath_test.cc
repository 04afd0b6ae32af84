#include "planner/cutting/toolpath.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "base/polygon_ops.h"
#include "tests/support/toolpath_piece.h"

namespace veneer::planner {
namespace {

using test::toolpath_piece;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAreArray;

Ring<BedFrame> bed_square(double x, double y, double side) {
  return {point<BedFrame>(x, y), point<BedFrame>(x + side, y), point<BedFrame>(x + side, y + side),
          point<BedFrame>(x, y + side)};
}

ToolpathOptions options_with_kerf(double mm) {
  ToolpathOptions options;
  options.recipe.kerf_back = options.recipe.kerf_show = Millimetres(mm);
  options.fit_clearance = Millimetres(0);
  return options;
}

std::vector<ToolpathPiece> grid_of_pieces(int columns, int rows) {
  std::vector<ToolpathPiece> pieces;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      pieces.push_back(toolpath_piece(r * columns + c + 1, bed_square(20 + 15 * c, 20 + 15 * r, 13), "A1-2"));
  return pieces;
}

std::vector<std::pair<long, long>> micrometres(const std::vector<Point<BedFrame>>& points) {
  std::vector<std::pair<long, long>> out;
  for (const auto& p : points) out.emplace_back(std::lround(p.x.count() * 1000), std::lround(p.y.count() * 1000));
  return out;
}

// Whole micrometres, the repeated first point left out.
auto corners(const StrokeIn<BedFrame>& stroke) { return micrometres({stroke.path.begin(), stroke.path.end() - 1}); }

auto exactly(const Ring<BedFrame>& ring) { return UnorderedElementsAreArray(micrometres(ring)); }

TEST(Toolpath, GrowsASquareByExactlyHalfAKerf) {
  const auto path = make_toolpath({toolpath_piece(1, bed_square(10, 20, 12))}, options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->strokes, SizeIs(1));
  const auto& cut = path->strokes[0];
  EXPECT_TRUE(cut.closed());
  EXPECT_EQ(cut.path.front(), cut.path.back());
  EXPECT_THAT(corners(cut), exactly(bed_square(9.865, 19.865, 12.27)));
}

TEST(Toolpath, GrowsAnLShapeByExactlyHalfAKerfInItsNotchToo) {
  const Ring<BedFrame> l = {point<BedFrame>(0, 0), point<BedFrame>(20, 0), point<BedFrame>(20, 8),
                            point<BedFrame>(8, 8), point<BedFrame>(8, 20), point<BedFrame>(0, 20)};
  const auto path = make_toolpath({toolpath_piece(1, l)}, options_with_kerf(0.3));
  ASSERT_TRUE(path.ok());
  const Ring<BedFrame> grown = {point<BedFrame>(-.15, -.15),  point<BedFrame>(20.15, -.15),
                                point<BedFrame>(20.15, 8.15), point<BedFrame>(8.15, 8.15),
                                point<BedFrame>(8.15, 20.15), point<BedFrame>(-.15, 20.15)};
  EXPECT_THAT(corners(path->strokes[0]), exactly(grown));
}

TEST(Toolpath, ShrinksHolesAndCutsThemBeforeTheOutline) {
  ToolpathPiece with_hole = toolpath_piece(1, bed_square(0, 0, 40));
  with_hole.holes = {bed_square(10, 10, 20)};
  const auto path = make_toolpath({with_hole}, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->strokes, SizeIs(2));
  // From the hole's own waste into its corner and around.
  const auto& hole = path->strokes[0].path;
  EXPECT_THAT(micrometres({hole.begin() + 1, hole.begin() + 5}), exactly(bed_square(10.1, 10.1, 19.8)));
  EXPECT_THAT(corners(path->strokes[1]), exactly(bed_square(-0.1, -0.1, 40.2)));
}

TEST(Toolpath, BurnsPiecesInAHoleBeforeThePieceAroundThem) {
  std::vector<ToolpathPiece> pieces = {toolpath_piece(1, bed_square(0, 0, 40)),
                                       toolpath_piece(2, bed_square(14, 14, 12))};
  pieces[0].holes = {bed_square(10, 10, 20)};
  const auto path = make_toolpath(pieces, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->pieces, SizeIs(2));
  EXPECT_EQ(path->pieces[0].piece, PieceId{2});
  EXPECT_EQ(path->pieces[1].piece, PieceId{1});
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
    if (stroke.role == StrokeRole::kCut) cut_free.insert(stroke.piece);
  }
  EXPECT_THAT(cut_free, SizeIs(12));
}

TEST(Toolpath, GathersTheMarksThatDoNotFit) {
  std::vector<ToolpathPiece> pieces;
  for (int i = 1; i <= 10; ++i)
    pieces.push_back(toolpath_piece(i, bed_square(10 * i, 0, 3.5), fmt::format("A10-{}", i)));
  const auto path = make_toolpath(pieces, options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->warnings, SizeIs(1));
  EXPECT_THAT(path->warnings[0], HasSubstr("10 marks do not fit on their pieces at 1.4 mm"));
  EXPECT_THAT(path->warnings[0], HasSubstr("A10-1, A10-2"));
  EXPECT_THAT(path->warnings[0], HasSubstr("A10-8 and 2 more"));
}

TEST(Toolpath, WarnsAboutAMarkThatDoesNotFitAndStillCuts) {
  const auto path = make_toolpath({toolpath_piece(9, bed_square(0, 0, 3.5), "A10-12")}, options_with_kerf(0.27));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->warnings, SizeIs(1));
  EXPECT_THAT(path->warnings[0], HasSubstr("A10-12"));
  for (const auto& stroke : path->strokes) EXPECT_EQ(stroke.role, StrokeRole::kCut);
}

TEST(Toolpath, RefusesOutlinesThatEncloseNothing) {
  const Ring<BedFrame> flat = {point<BedFrame>(0, 0), point<BedFrame>(10, 0), point<BedFrame>(20, 0)};
  const auto path = make_toolpath({toolpath_piece(7, flat, "A1-1")}, options_with_kerf(0.27));
  ASSERT_FALSE(path.ok());
  EXPECT_EQ(path.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(path.error().message, HasSubstr("A1-1"));
}

TEST(Toolpath, StartsACutAtACorner) {
  Ring<BedFrame> with_points_on_edges;
  for (int i = 0; i < 4; ++i) {
    const auto corner = bed_square(0, 0, 10);
    const auto &a = corner[static_cast<std::size_t>(i)], &b = corner[static_cast<std::size_t>((i + 1) % 4)];
    with_points_on_edges.push_back(a);
    with_points_on_edges.push_back(
        point<BedFrame>((a.x + b.x).count() / 2, (a.y + b.y).count() / 2 - (i == 0 ? .1 : 0)));
  }
  auto options = options_with_kerf(0.2);
  options.start = point<BedFrame>(5, -3);  // nearest to the slight bend in the middle of the lower edge
  const auto path = make_toolpath({toolpath_piece(1, with_points_on_edges)}, options);
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

TEST(Toolpath, JudgesEdgesByTheKerfAtTheShowFaceAndGivesTheJointItsClearance) {
  ToolpathOptions options;
  options.recipe.kerf_back = Millimetres(0.30);
  options.recipe.kerf_show = Millimetres(0.20);
  const auto path = make_toolpath({toolpath_piece(1, bed_square(10, 10, 12))}, options);
  ASSERT_TRUE(path.ok());
  // The default joint of 0.05 mm: each edge gives 0.025, so the piece's show face is a square of 11.95 mm.
  const auto beam = bounds(path->strokes[0].path);
  EXPECT_NEAR(beam.width().count() - 0.20, 11.95, 0.0021);
  // On the back it burns no farther than the ledger has booked: the outline grown by the widest kerf.
  EXPECT_GE(beam.min.x.count() - 0.15, 10 - 0.30);
}

TEST(Toolpath, TakesTheRecipeOfEachPiecesWood) {
  std::vector<ToolpathPiece> pieces = {toolpath_piece(1, bed_square(10, 10, 12), "A1-1"),
                                       toolpath_piece(2, bed_square(30, 10, 12), "A1-2")};
  Recipe oak;
  oak.cut_speed = MmPerSecond(9), oak.cut_passes = 2, oak.cut_power = PowerFraction(0.9),
  oak.air = oak.engrave_air = false;
  oak.kerf_back = oak.kerf_show = Millimetres(0.4);
  pieces[1].recipe = oak;
  const auto path = make_toolpath(pieces, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  for (const auto& stroke : path->strokes) {
    if (stroke.role != StrokeRole::kCut) continue;
    const bool is_oak = stroke.piece == PieceId{2};
    EXPECT_EQ(stroke.speed.count(), is_oak ? 9 : 15);
    EXPECT_EQ(stroke.passes, is_oak ? 2 : 1);
    EXPECT_EQ(stroke.air, !is_oak);
    EXPECT_NEAR(bounds(stroke.path).width().count(), is_oak ? 12.4 : 12.2, 1e-6);
  }
}

TEST(Toolpath, BeginsInTheWasteThatIsBookedForIt) {
  const double kerf = 0.27;
  ToolpathPiece with_waste = toolpath_piece(1, bed_square(10, 10, 12));
  with_waste.leads = {{point<BedFrame>(22.8, 22.8), point<BedFrame>(22.135, 22.135)}};
  auto options = options_with_kerf(kerf);
  options.start = point<BedFrame>(0, 0);  // near the other corner
  const auto path = make_toolpath({with_waste}, options);
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->strokes, SizeIs(1));
  EXPECT_EQ(path->pieces[0].lead, with_waste.leads[0].begin);
  const auto& cut = path->strokes[0].path;
  EXPECT_FALSE(path->strokes[0].closed());
  EXPECT_EQ(cut.front(), with_waste.leads[0].begin);
  // Into the corner, around, and on past it.
  EXPECT_LT(distance(cut[1], point<BedFrame>(22.135, 22.135)).count(), 1e-6);
  EXPECT_NEAR(distance(cut.back(), cut[1]).count(), 0.3, 1e-6);
  // Without waste that is booked for it, it begins on its edge.
  with_waste.leads.clear();
  const auto without = make_toolpath({with_waste}, options);
  ASSERT_TRUE(without.ok());
  EXPECT_FALSE(without->pieces[0].lead.has_value());
  EXPECT_THAT(corners(without->strokes[0]), exactly(bed_square(9.865, 9.865, 12.27)));
}

TEST(Toolpath, LeadsIntoAHoleFromItsWasteButNotOverAPieceThatLiesInIt) {
  ToolpathPiece frame = toolpath_piece(1, bed_square(0, 0, 40));
  frame.holes = {bed_square(10, 10, 20)};
  const auto free = make_toolpath({frame}, options_with_kerf(0.2));
  ASSERT_TRUE(free.ok());
  EXPECT_FALSE(free->strokes[0].closed());
  EXPECT_TRUE(Region<BedFrame>(bed_square(10.5, 10.5, 19)).contains(free->strokes[0].path.front()));
  // Filled by a piece that touches its kerf.
  const auto filled = make_toolpath({frame, toolpath_piece(2, bed_square(10.4, 10.4, 19.2))}, options_with_kerf(0.2));
  ASSERT_TRUE(filled.ok());
  ASSERT_EQ(filled->pieces[0].piece, PieceId{2});
  EXPECT_TRUE(filled->strokes[1].closed()) << "no room to lead in";
}

TEST(Toolpath, HoldsSmallPiecesByBridgesAwayFromTheirCorners) {
  const double kerf = 0.2, kept = 0.4;
  const auto path = make_toolpath({toolpath_piece(1, bed_square(10, 10, 6))}, options_with_kerf(kerf));
  ASSERT_TRUE(path.ok());
  EXPECT_EQ(path->pieces[0].bridges, 2U);
  double cut = 0;
  for (const auto& stroke : path->strokes) {
    EXPECT_FALSE(stroke.closed());
    for (std::size_t i = 1; i < stroke.path.size(); ++i) cut += distance(stroke.path[i - 1], stroke.path[i]).count();
  }
  EXPECT_NEAR(4 * 6.2 - cut, 2 * (kept + kerf), 1e-6);
  // All four corners are cut.
  for (const auto& corner : bed_square(9.9, 9.9, 6.2)) {
    bool through = false;
    for (const auto& stroke : path->strokes) through |= std::count(stroke.path.begin(), stroke.path.end(), corner) > 0;
    EXPECT_TRUE(through);
  }
  // Larger pieces cannot tip; and nobody is made to have bridges.
  EXPECT_EQ(make_toolpath({toolpath_piece(1, bed_square(10, 10, 12))}, options_with_kerf(kerf))->pieces[0].bridges, 0U);
  auto off = options_with_kerf(kerf);
  off.bridges.on = false;
  EXPECT_EQ(make_toolpath({toolpath_piece(1, bed_square(10, 10, 6))}, off)->pieces[0].bridges, 0U);
}

// The middle of a horseshoe's longest side is the narrow bow within, where a knife could not cut straight across: such
// a piece of a mosaic hung in its panel, and the ledger called it cut.
TEST(Toolpath, PutsNoBridgeWhereTheOutlineBends) {
  Ring<BedFrame> arch = {point<BedFrame>(14.1, 10), point<BedFrame>(17, 10), point<BedFrame>(17, 15.6),
                         point<BedFrame>(10, 15.6), point<BedFrame>(10, 10), point<BedFrame>(12.9, 10)};
  for (int i = 0; i <= 12; ++i) {
    const double angle = kPi - i * kPi / 12;
    arch.push_back(point<BedFrame>(13.5 + 0.6 * std::cos(angle), 13 + 0.6 * std::sin(angle)));
  }
  const auto path = make_toolpath({toolpath_piece(1, arch, "")}, options_with_kerf(0.25));
  ASSERT_TRUE(path.ok());
  EXPECT_EQ(path->pieces[0].bridges, 2U);
  const auto direction = [](const Point<BedFrame>& a, const Point<BedFrame>& b) {
    return std::atan2((b.y - a.y).count(), (b.x - a.x).count());
  };
  ASSERT_GE(path->strokes.size(), 2U);
  for (std::size_t k = 1; k < path->strokes.size(); ++k) {
    const auto &before = path->strokes[k - 1].path, &after = path->strokes[k].path;
    const double across = direction(before.back(), after.front());
    EXPECT_LT(std::abs(std::remainder(direction(before.end()[-2], before.back()) - across, 2 * kPi)), kPi / 6);
    EXPECT_LT(std::abs(std::remainder(direction(after[0], after[1]) - across, 2 * kPi)), kPi / 6);
  }
}

TEST(Toolpath, WarnsOfASmallPieceThatHasNoRoomForABridge) {
  const auto path = make_toolpath({toolpath_piece(4, bed_square(10, 10, 1.5), "")}, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  ASSERT_THAT(path->warnings, SizeIs(1));
  EXPECT_THAT(path->warnings[0], HasSubstr("bridge"));
}

TEST(Toolpath, HoldsASmallDiscByBridgesToo) {
  Ring<BedFrame> disc;
  for (int i = 0; i < 60; ++i)
    disc.push_back(point<BedFrame>(20 + 3 * std::cos(i * kPi / 30), 20 + 3 * std::sin(i * kPi / 30)));
  const auto path = make_toolpath({toolpath_piece(1, disc)}, options_with_kerf(0.2));
  ASSERT_TRUE(path.ok());
  EXPECT_EQ(path->pieces[0].bridges, 2U);
  // On opposite sides.
  ASSERT_GE(path->strokes.size(), 2U);
}

// The strokes of a piece of its own, which is led into from `lead`, leave its bridges whole: they begin and end on the
// beam's way, what lies between two of them is a bridge's width of it, and only the first and the last are at the door.
// Says what is wrong.
std::string wrong_with_bridges(const Toolpath& path, const Point<BedFrame>& lead, Millimetres kerf) {
  const LeadOptions leads;
  const auto& strokes = path.strokes;
  for (const auto& stroke : strokes)
    for (const auto& p : stroke.path)
      if (!std::isfinite(p.x.count()) || !std::isfinite(p.y.count())) return "a stroke runs nowhere";
  if (strokes.size() != path.pieces[0].bridges + 1)
    return fmt::format("{} strokes with {} bridges", strokes.size(), path.pieces[0].bridges);
  if (strokes.front().path.front() != lead) return "it does not begin where wood is booked for it";
  const Point<BedFrame> door = strokes.front().path[1];
  const double wide = (BridgeOptions{}.width + kerf).count();
  for (std::size_t k = 1; k < strokes.size(); ++k)
    if (const double gap = distance(strokes[k - 1].path.back(), strokes[k].path.front()).count();
        gap > wide + 1e-6 || gap < 0.8 * wide)
      return fmt::format("a bridge of {} mm", gap);
  if (strokes.size() > 1 && distance(strokes.front().path.back(), door).count() < 1e-6) return "it ends at its door";
  const auto& last = strokes.back().path;
  if (std::none_of(last.begin(), last.end(), [&](const auto& p) { return distance(p, door).count() < 1e-6; }))
    return "it never comes back to its door";
  return distance(last.back(), door).count() <= leads.overlap.count() + 1e-6 ? "" : "it runs on too far";
}

// A straight way from `begin` to the vertex that is nearest.
Lead<BedFrame> led_into(const Ring<BedFrame>& outline, const Point<BedFrame>& begin) {
  return {begin, outline[nearest_vertex(outline, begin)]};
}

// A lens of 14 x 6 mm, led into in the middle of a long side, where a bridge would stand: what was cut there ran to
// nowhere, and the daemon with it (seed 1 of the demo's workshop, a piece whose waist lay at its door).
TEST(Toolpath, PutsNoBridgeWhereTheCutBegins) {
  Ring<BedFrame> lens;
  for (int i = 0; i < 40; ++i) {
    const double along = i < 20 ? 7.0 * (10 - i) / 10 : 7.0 * (i - 30) / 10;
    const double high = 3 * (1 - along * along / 49) * (i < 20 ? 1 : -1);
    lens.push_back(point<BedFrame>(50 + along, 40 + high));
  }
  for (const double aside : {0.0, 0.2, -0.3, 0.7, -1.4}) {
    auto piece = toolpath_piece(1, lens);
    piece.leads = {led_into(piece.outline, point<BedFrame>(50 + aside, 44))};
    const auto path = make_toolpath({piece}, options_with_kerf(0.2));
    ASSERT_TRUE(path.ok());
    EXPECT_EQ(path->pieces[0].bridges, 2U);
    EXPECT_EQ(wrong_with_bridges(*path, piece.leads[0].begin, Millimetres(0.2)), "") << aside;
  }
}

RC_GTEST_PROP(Toolpath, LeavesBridgesWholeWhereverTheCutBegins, ()) {
  const int n = *rc::gen::inRange(5, 40);
  Ring<BedFrame> outline;
  for (int i = 0; i < n; ++i) {
    const double r = *rc::gen::inRange(26, 38) / 10.0;
    outline.push_back(point<BedFrame>(100 + r * std::cos(2 * kPi * i / n), 100 + r * std::sin(2 * kPi * i / n)));
  }
  auto piece = toolpath_piece(1, outline);
  const double angle = 2 * kPi * *rc::gen::inRange(0, 360) / 360.0;
  piece.leads = {led_into(outline, point<BedFrame>(100 + 5 * std::cos(angle), 100 + 5 * std::sin(angle)))};
  const auto path = make_toolpath({piece}, options_with_kerf(0.2));
  RC_ASSERT(path.ok());
  RC_ASSERT(wrong_with_bridges(*path, piece.leads[0].begin, Millimetres(0.2)) == "");
}

TEST(Toolpath, RefusesAPathThatLeadsNowhere) {
  for (const double nowhere : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<ToolpathPiece> pieces = grid_of_pieces(2, 1);
    pieces[1].leads = {{point<BedFrame>(nowhere, 30), pieces[1].outline.front()}};
    const auto path = make_toolpath(pieces, options_with_kerf(0.2));
    ASSERT_FALSE(path.ok());
    EXPECT_THAT(path.error().message, HasSubstr("piece 2 (A1-2)"));
  }
}

TEST(Toolpath, FollowsTheAssemblyWhenAsked) {
  auto pieces = grid_of_pieces(4, 4);
  std::reverse(pieces.begin(), pieces.end());
  auto options = options_with_kerf(0.2);
  options.assembly_order = true;
  const auto path = make_toolpath(pieces, options);
  ASSERT_TRUE(path.ok());
  for (std::size_t i = 0; i < pieces.size(); ++i) EXPECT_EQ(path->pieces[i].piece, pieces[i].piece);
  auto shortest = options_with_kerf(0.2);
  shortest.cool_distance = Millimetres(0);
  EXPECT_GE(path->travel.count(), make_toolpath(pieces, shortest)->travel.count());
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
  const auto path = make_toolpath({toolpath_piece(1, outline)}, options_with_kerf(kerf));
  RC_ASSERT(path.ok());
  const Region<BedFrame> piece(outline);
  const auto band = subtract(offset(piece, Millimetres(kerf + 0.003)), offset(piece, Millimetres(-0.003)));
  const auto swept = [&](const Point<BedFrame>& p) { return band.contains(p); };
  for (const auto& p : path->strokes[0].path) RC_ASSERT(swept(p));
}

}  // namespace
}  // namespace veneer::planner
