#include "planner/cutting/cut_order.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <set>
#include <stdexcept>

#include "base/frames.h"
#include "planner/cutting/lead_choice.h"
#include "tests/planner/cutting/scattered_pieces.h"

namespace veneer::planner {
namespace {

using ::testing::SizeIs;

CutSite place(double x, double y) { return {{{point<BedFrame>(x, y), point<BedFrame>(x, y), {}}}, {}, {}}; }

std::vector<CutSite> lattice(int columns, int rows) {
  std::vector<CutSite> sites;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      sites.push_back(place(20 + 15 * c, 20 + 15 * r));
    }
  return sites;
}

// What cut_order() makes short: the dark way from `start` through the visits, with what the ways cost in themselves.
Millimetres tour_length(const std::vector<CutSite>& sites, const std::vector<CutVisit>& visits, Point<BedFrame> start) {
  Millimetres sum{0};
  Point<BedFrame> at = start;
  for (const CutVisit& v : visits) {
    const CutWay& way = sites[v.site].ways[v.way];
    sum += distance(at, way.in) + way.inner;
    at = way.out;
  }
  return sum;
}

TEST(CutOrder, ComesCloseToTheShortestWayThroughALattice) {
  const auto sites = lattice(20, 12);
  const auto visits = cut_order(sites, {});
  // It cannot be visited in less than a step per site.
  EXPECT_LT(tour_length(sites, visits, {}).count(), 1.05 * (239 * 15 + std::hypot(20, 20)));
}

TEST(CutOrder, EntersAndLeavesEachSiteWhereItIsShort) {
  // Two sites with doors at both ends of a line of 10 mm: the near doors are taken.
  const auto two_doors = [](double x) {
    CutSite site;
    for (const double door : {x, x + 10}) site.ways.push_back({point<BedFrame>(door, 0), point<BedFrame>(door, 0), {}});
    return site;
  };
  const std::vector<CutSite> sites = {two_doors(20), two_doors(31)};
  const auto visits = cut_order(sites, {});
  EXPECT_NEAR(tour_length(sites, visits, {}).count(), 31, 1e-9);
}

TEST(CutOrder, DoesNotBurnNeighboursOneAfterTheOther) {
  auto sites = lattice(20, 12);
  const auto shortest = cut_order(sites, {});
  for (std::size_t i = 0; i < sites.size(); ++i)
    for (std::size_t k = 0; k < sites.size(); ++k)
      if (i != k && distance(sites[i].ways[0].in, sites[k].ways[0].in).count() < 22) sites[i].hot.push_back(k);
  EXPECT_GT(hot_pairs(sites, shortest), 200U);
  const auto cold = cut_order(sites, {});
  EXPECT_EQ(hot_pairs(sites, cold), 0U);
  // All eight around a site are hot, so each step is two sites long.
  EXPECT_LT(tour_length(sites, cold, {}).count(), 2.1 * tour_length(sites, shortest, {}).count());
}

TEST(CutOrder, KeepsTheGivenOrderWhenAsked) {
  const auto sites = lattice(5, 4);
  const auto visits = cut_order(sites, {{}, true});
  for (std::size_t i = 0; i < sites.size(); ++i) EXPECT_EQ(visits[i].site, i);
}

RC_GTEST_PROP(CutOrder, VisitsEverySiteOnceAndKeepsItsDemands, ()) {
  const auto n = static_cast<std::size_t>(*rc::gen::inRange(0, 16));
  std::vector<CutSite> sites;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = *rc::gen::inRange(0, 500), y = *rc::gen::inRange(0, 300);
    sites.push_back(place(x, y));
    if (i > 0 && *rc::gen::inRange(0, 3) == 0) {
      sites[i].hot.push_back(i - 1);
      sites[i - 1].hot.push_back(i);
    }
    if (*rc::gen::inRange(0, 2) == 1)
      sites.back().ways.push_back({point<BedFrame>(x + 5, y), point<BedFrame>(x, y), {}});
    // Demands only on later indices: no cycles.
    if (i > 0 && *rc::gen::inRange(0, 4) == 0)
      sites[static_cast<std::size_t>(*rc::gen::inRange(0, static_cast<int>(i)))].after.push_back(i);
  }
  const CutOrderOptions options;
  const auto visits = cut_order(sites, options);
  std::set<std::size_t> done;
  for (const CutVisit& visit : visits) {
    RC_ASSERT(visit.way < sites[visit.site].ways.size());
    for (const std::size_t before : sites[visit.site].after) RC_ASSERT(done.contains(before));
    RC_ASSERT(done.insert(visit.site).second);
  }
  RC_ASSERT(done.size() == n);
  RC_ASSERT(visits == cut_order(sites, options));
}

TEST(CutOrder, SurvivesDemandsThatGoInACircle) {
  std::vector<CutSite> sites = {place(0, 0), place(1, 0), place(2, 0)};
  sites[0].after = {1}, sites[1].after = {2}, sites[2].after = {0};
  EXPECT_THAT(cut_order(sites, {}), SizeIs(3));
}

// ---- The demo's panel: 300 pieces of an artwork, found all over the wood -----------------------------------------

double apart(const ToolpathPiece& a, const ToolpathPiece& b) {
  double least = 1e18;
  const auto corners_to_edges = [&least](const Ring<BedFrame>& points, const Ring<BedFrame>& ring) {
    for (const auto& p : points)
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const auto &q = ring[i], &r = ring[(i + 1) % ring.size()];
        const double ux = (r.x - q.x).count(), uy = (r.y - q.y).count();
        const double px = (p.x - q.x).count(), py = (p.y - q.y).count();
        const double t = std::clamp((px * ux + py * uy) / (ux * ux + uy * uy), 0.0, 1.0);
        least = std::min(least, std::hypot(px - t * ux, py - t * uy));
      }
  };
  corners_to_edges(a.outline, b.outline);
  corners_to_edges(b.outline, a.outline);
  return least;
}

// A simple sender's way: from where the head is to the piece whose entry is nearest, its cut begun at the nearest door.
// With `cool`, of those farther than that from the piece before, as long as there are any.
std::vector<ToolpathPiece> nearest_neighbour_order(std::vector<ToolpathPiece> pieces, double cool = 0) {
  std::vector<ToolpathPiece> order;
  Point<BedFrame> at{};
  while (!pieces.empty()) {
    auto best = pieces.begin();
    double least = 1e18;
    for (auto it = pieces.begin(); it != pieces.end(); ++it) {
      const bool hot = cool > 0 && !order.empty() && apart(order.back(), *it) < cool;
      for (const auto& p : it->outline)
        if (const double d = distance(at, p).count() + (hot ? 1e6 : 0); d < least) least = d, best = it;
    }
    at = *std::min_element(best->outline.begin(), best->outline.end(),
                           [&](const auto& a, const auto& b) { return distance(at, a) < distance(at, b); });
    order.push_back(*best);
    pieces.erase(best);
  }
  return order;
}

double travel_of(const std::vector<ToolpathPiece>& pieces, bool as_given, double cool_mm) {
  ToolpathOptions options;
  options.assembly_order = as_given;
  options.cool_distance = Millimetres(cool_mm);
  const auto path = make_toolpath(pieces, options);
  if (!path.ok()) throw std::runtime_error(path.error().message);
  EXPECT_EQ(path->pieces.size(), pieces.size());
  // A nearest neighbour runs out of cool pieces towards its end; that it breaks the rule then makes its way shorter.
  if (cool_mm > 0 && !as_given) {
    EXPECT_EQ(path->hot_pairs, 0U);
  }
  return path->travel.count();
}

// Beginning where a job's pieces do: in waste that is booked with them.
std::vector<ToolpathPiece> led(std::vector<ToolpathPiece> pieces) {
  const Isometry2<PanelFrame, BedFrame> panel_from_bed;
  std::vector<LeadPiece> to_lead;
  for (const auto& piece : pieces) {
    const Ring<PanelFrame> outline = panel_from_bed * piece.outline;
    to_lead.push_back({outline, piece.mark, piece.artwork_up, piece.recipe.value_or(Recipe()),
                       offset(Region<PanelFrame>(outline), Millimetres(0.27))});
  }
  const LeadRoom room{{cv::Mat(3400, 4800, CV_8UC1, cv::Scalar(255)), ScanResolution{10}, {}}, {}, Millimetres(0.27)};
  const auto leads = choose_leads(to_lead, room, {});
  if (!leads.ok()) throw std::runtime_error(leads.error().message);
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (const auto& in = (*leads)[i])
      pieces[i].leads = {{panel_from_bed.inverse() * in->way.begin, panel_from_bed.inverse() * in->way.end}};
  return pieces;
}

// Each way against others that keep the same rule: without cooling, and with none of two neighbours after the other.
// `rows` has no rule; with cooling it would be longer still.
TEST(CutOrder, TravelsThirtyPercentLessThanRowsAndTenLessThanNearestNeighbours) {
  struct Case {
    const char* name;
    std::vector<ToolpathPiece> pieces;
  };
  const Case cases[] = {{"without marks", test::scattered_pieces(300, 14, false)},
                        {"with marks", test::scattered_pieces(300, 14, true)},
                        {"with marks and lead-ins", led(test::scattered_pieces(300, 14, true))}};
  for (const auto& [name, pieces] : cases) {
    const double rows = travel_of(test::sorted_by_panel_rows(pieces), true, 0);
    const double reading = travel_of(pieces, true, 0);
    for (const double cool : {0.0, 2.0}) {
      const double best = travel_of(pieces, false, cool);
      const double nearest = travel_of(nearest_neighbour_order(pieces, cool), true, cool);
      std::printf(
          "%s, %s: %.0f mm; nearest neighbour by the same rule %.0f (%.1f %% shorter), rows %.0f, artwork %.0f\n", name,
          cool > 0 ? "cooled" : "not cooled", best, nearest, 100 - 100 * best / nearest, rows, reading);
      EXPECT_LT(best, 0.7 * rows) << name;
      EXPECT_LT(best, 0.9 * nearest) << name;
    }
  }
}

}  // namespace
}  // namespace veneer::planner
