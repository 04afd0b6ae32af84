// The web of wood around each piece's kerf: no cut parts anything from a sheet but the piece itself, and what is burnt
// is booked.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <stdexcept>

#include "base/polygon_ops.h"
#include "planner/cutting/lead_choice.h"
#include "planner/plan.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::wood_panel;

PlanOptions webbed() {
  PlanOptions options;
  options.dpi = 50.8, options.rotations = 7, options.threads = 1;
  options.priority = Priority::kCentre;  // saliency costs more time than all the rest here
  options.web = kPieceWeb;
  return options;
}

// How many parts the wood of a sheet falls into once `gone` is gone.
std::size_t parts_of(const Region<PanelFrame>& sheet, const Region<PanelFrame>& gone) {
  constexpr double kRounding = 1e-3;  // mm2
  std::size_t parts = 0;
  for (const auto& ring : subtract(sheet, gone).rings()) parts += signed_area(ring) > kRounding ? 1 : 0;
  return parts;
}

Region<PanelFrame> rectangle(const Point<PanelFrame>& low, const Point<PanelFrame>& high) {
  return Region<PanelFrame>(Ring<PanelFrame>{low, {high.x, low.y}, high, {low.x, high.y}});
}

Region<PanelFrame> sheet_of(const StockPanel& panel) {
  return rectangle(panel.picture.from_pixels(0, panel.picture.pixels.rows),
                   panel.picture.from_pixels(panel.picture.pixels.cols, 0));
}

// Screw holes: what is not free, but for the rim of the sheet.
std::vector<Region<PanelFrame>> holes_of(const StockPanel& panel) {
  constexpr int kRim = 2;
  std::vector<Region<PanelFrame>> out;
  const cv::Mat& free = panel.free.pixels;
  for (int r = kRim; r < free.rows - kRim; ++r)
    for (int c = kRim; c < free.cols - kRim; ++c)
      if (free.at<unsigned char>(r, c) == 0)
        out.push_back(rectangle(panel.free.from_pixels(c, r + 1), panel.free.from_pixels(c + 1, r)));
  return out;
}

struct Booked {
  std::vector<LeadPiece> pieces;
  std::vector<std::optional<LeadIn>> leads;
  std::vector<Region<PanelFrame>> areas;  // of the pieces, with their kerfs and lead-ins
};

ToolpathOptions cutting() {
  ToolpathOptions options;
  options.cool_distance = Millimetres(0), options.bridges.on = false;
  return options;
}

// What the cell would book on the panel.
Booked booked_on(const StockPanel& panel, const Plan& plan) {
  Booked out;
  for (const Piece& piece : plan.pieces) {
    if (!piece.placement || !(piece.placement->panel == panel.id)) continue;
    LeadPiece& it = out.pieces.emplace_back();
    it.outline = piece.panel_outline();
    it.recipe.kerf_back = it.recipe.kerf_show = plan.kerf;
    it.allocation = offset(Region<PanelFrame>(it.outline), plan.kerf);
  }
  auto leads = choose_leads(out.pieces, {panel.free, {}, plan.kerf}, cutting());
  if (!leads.ok()) throw std::runtime_error(leads.error().message);
  out.leads = std::move(*leads);
  for (std::size_t i = 0; i < out.pieces.size(); ++i)
    out.areas.push_back(out.leads[i] ? unite(out.pieces[i].allocation, out.leads[i]->burnt) : out.pieces[i].allocation);
  return out;
}

// How many parts the cuts of a plan add to what a panel falls into, when wood narrower than `web` breaks.
std::size_t chips(const StockPanel& panel, const Plan& plan, Millimetres web) {
  const Region<PanelFrame> sheet = offset(sheet_of(panel), web * -0.5);
  const std::vector<Region<PanelFrame>> holes = holes_of(panel);
  const Region<PanelFrame> open = holes.empty() ? Region<PanelFrame>() : offset(unite(holes), web / 2);
  std::vector<Region<PanelFrame>> gone{open};
  for (const auto& area : booked_on(panel, plan).areas) gone.push_back(offset(area, web / 2, Corners::kRound));
  return parts_of(sheet, unite(gone)) - parts_of(sheet, open);
}

RC_GTEST_PROP(Web, HoldsAllWoodThatNoPieceTakes, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000000);
  PlanOptions options = webbed();
  options.patch = Millimetres(*rc::gen::inRange(50, 110) / 10.0);
  options.kerf = Millimetres(*rc::gen::inRange(5, 40) / 100.0);
  options.refine = *rc::gen::element(Refine::kDp, Refine::kNone);
  options.rematch = options.refine == Refine::kDp ? *rc::gen::inRange(0, 2) : 0;
  options.adaptive_levels = *rc::gen::inRange(0, 2);
  options.optimize = *rc::gen::element(Optimize::kGreedy, Optimize::kGlobal);
  options.optimize_iterations = 2000;
  const std::vector<StockPanel> stock{wood_panel("P", 150, 120, 50.8, seed), wood_panel("Q", 80, 90, 45, seed + 9)};
  const auto plan = make_plan(std::vector{blob_artwork("A", 40, 52, 34_mm, seed + 1)}, stock, options);
  RC_ASSERT(plan.ok());
  constexpr Millimetres kRounding{0.02};
  for (const StockPanel& panel : stock) RC_ASSERT(chips(panel, *plan, kPieceWeb - kRounding) == 0U);
}

// On the bed outlines are turned, mirrored and rounded anew; what is burnt of a piece stays within what is booked for
// it.
RC_GTEST_PROP(Web, IsLeftAloneByTheBeam, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000000);
  PlanOptions options = webbed();
  options.patch = Millimetres(*rc::gen::inRange(70, 130) / 10.0);
  options.kerf = Millimetres(*rc::gen::inRange(10, 35) / 100.0);
  options.refine = Refine::kDp;
  const StockPanel panel = wood_panel("P", 200, 160, 50.8, seed);
  const auto plan = make_plan(std::vector{blob_artwork("A", 40, 52, 40_mm, seed + 1)}, std::vector{panel}, options);
  RC_ASSERT(plan.ok());
  const Booked booked = booked_on(panel, *plan);
  const Isometry2<BedFrame, PanelFrame> bed_from_panel(Radians(*rc::gen::inRange(0, 628) / 100.0),
                                                       point<BedFrame>(80.1234, 20.4321), Handedness::kImproper);
  std::vector<ToolpathPiece> laid;
  for (std::size_t i = 0; i < booked.pieces.size(); ++i) {
    ToolpathPiece& piece = laid.emplace_back();
    piece.piece = PieceId{static_cast<std::int64_t>(i)};
    piece.outline = bed_from_panel * booked.pieces[i].outline;
    piece.recipe = booked.pieces[i].recipe;
    if (booked.leads[i])
      piece.leads = {{bed_from_panel * booked.leads[i]->way.begin, bed_from_panel * booked.leads[i]->way.end}};
  }
  const auto path = make_toolpath(laid, cutting());
  RC_ASSERT(path.ok());
  for (const auto& stroke : path->strokes) {
    // Half a kerf within what is booked, but for some micrometres of rounding.
    const auto within =
        offset(booked.areas[static_cast<std::size_t>(stroke.piece.value)], -(plan->kerf / 2 - Millimetres(0.02)));
    const auto way = bed_from_panel.inverse() * stroke.path;
    for (std::size_t k = 1; k < way.size(); ++k)
      for (const double t : {0.0, 0.5, 1.0})
        RC_ASSERT(within.contains(
            {way[k - 1].x + (way[k].x - way[k - 1].x) * t, way[k - 1].y + (way[k].y - way[k - 1].y) * t}));
  }
}

// What the first property looks for is there to be found.
TEST(Web, ChipsFallBetweenNeighboursThatTouchTwice) {
  const Region<PanelFrame> sheet = rectangle(point<PanelFrame>(0, 0), point<PanelFrame>(40, 40));
  const auto bay = [](double x, double inwards) {
    return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, 10), point<PanelFrame>(x + 4 * inwards, 20),
                                               point<PanelFrame>(x, 30), point<PanelFrame>(x + 10 * inwards, 30),
                                               point<PanelFrame>(x + 10 * inwards, 10)});
  };
  EXPECT_EQ(parts_of(sheet, unite(bay(20, -1), bay(19.99, 1))), 2U);
  EXPECT_EQ(parts_of(sheet, unite(bay(20, -1), bay(20.4, 1))), 1U);
  EXPECT_EQ(parts_of(sheet, unite(offset(bay(20, -1), 0.2_mm), offset(bay(20.3, 1), 0.2_mm))), 2U);
}

}  // namespace
}  // namespace veneer::planner
