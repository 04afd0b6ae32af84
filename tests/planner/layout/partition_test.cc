// Partitions, the curves of their edges, and what can be made of their faces.
#include "planner/layout/partition.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "planner/layout/adaptive_grid.h"
#include "planner/layout/bezier_fit.h"
#include "planner/layout/fabrication.h"
#include "tests/planner/layout/partition_checks.h"

namespace veneer::planner {
namespace {

// Every edge is used forwards by one face and backwards by the other, or by one on the artwork's border.
void expect_whole(const Partition& partition) {
  std::vector<int> forwards(partition.edges.size()), backwards = forwards;
  for (const PartitionFace& face : partition.faces)
    for (std::size_t i = 0; i < face.boundary.size(); ++i) {
      const DirectedEdge &it = face.boundary[i], &next = face.boundary[(i + 1) % face.boundary.size()];
      ++(it.backwards ? backwards : forwards)[it.edge];
      const auto &a = partition.edges[it.edge].curve, &b = partition.edges[next.edge].curve;
      EXPECT_EQ(it.backwards ? a.front() : a.back(), next.backwards ? b.back() : b.front());
    }
  for (std::size_t e = 0; e < partition.edges.size(); ++e) {
    const PartitionEdge& edge = partition.edges[e];
    EXPECT_EQ(forwards[e], edge.left == PartitionEdge::kOutside ? 0 : 1);
    EXPECT_EQ(backwards[e], edge.right == PartitionEdge::kOutside ? 0 : 1);
  }
}

TEST(Partition, OfAGridHasTheGridsOutlines) {
  const std::vector<Patch> patches = grid_layout(56.9_mm, 31_mm, 4_mm);
  const Partition partition = partition_of(56.9_mm, 31_mm, patches);
  expect_whole(partition);
  ASSERT_EQ(partition.faces.size(), patches.size());
  for (std::size_t f = 0; f < patches.size(); ++f) EXPECT_EQ(outline_of(partition, f), patches[f].outline);
  const GridSize size = grid_size(56.9_mm, 31_mm, 4_mm);
  const auto edges = static_cast<std::size_t>((size.rows + 1) * size.columns + size.rows * (size.columns + 1));
  EXPECT_EQ(partition.edges.size(), edges);
}

// Three squares in a row, the first border between two of which bends to here.
Partition three_squares(const Point<ArtworkFrame>& bent) {
  const Partition plain = partition_of(30_mm, 10_mm, grid_layout(30_mm, 10_mm, 10_mm));
  Partition out = plain;
  for (PartitionEdge& edge : out.edges)
    if (edge.left != PartitionEdge::kOutside && edge.right != PartitionEdge::kOutside && edge.curve.front().x == 10_mm)
      edge.curve[1] = edge.curve[2] = bent;
  return out;
}

TEST(Partition, CoversItsArtworkOnceOrIsFoundOut) {
  EXPECT_NO_THROW(expect_exact_cover(three_squares(point<ArtworkFrame>(12, 5))));
  EXPECT_ANY_THROW(expect_exact_cover(three_squares(point<ArtworkFrame>(29, 5))))
      << "through the second into the third";
  // What the upper border leaves out, the lower one takes from beyond the artwork.
  Partition shifted = three_squares(point<ArtworkFrame>(12, 5));
  for (PartitionEdge& edge : shifted.edges) {
    if (edge.left != PartitionEdge::kOutside && edge.right != PartitionEdge::kOutside) continue;
    const auto &a = edge.curve.front(), &b = edge.curve.back();
    if (a.y == b.y && std::min(a.x, b.x) == 20_mm) edge.curve[1].y -= 1_mm, edge.curve[2].y -= 1_mm;
  }
  EXPECT_ANY_THROW(expect_exact_cover(shifted));
}

// The large squares where `whole` says so, their parts elsewhere.
void cut_up(const std::vector<PatchTree>& trees, std::vector<Patch>& out) {
  for (const PatchTree& tree : trees) {
    if (tree.parts.empty() || *rc::gen::arbitrary<bool>())
      out.push_back(tree.patch);
    else
      cut_up(tree.parts, out);
  }
}

RC_GTEST_PROP(Partition, OfPatchesOfSeveralSizesDividesTheirEdgesAtTJoints, ()) {
  std::vector<Patch> patches;
  cut_up(adaptive_layout(37_mm, 26_mm, 4_mm, *rc::gen::inRange(1, 4)), patches);
  const Partition partition = partition_of(37_mm, 26_mm, patches);
  expect_whole(partition);
  for (std::size_t f = 0; f < patches.size(); ++f) RC_ASSERT(outline_of(partition, f) == patches[f].outline);
}

TEST(Partition, FlattensCurvesToAHundredthOfAMillimetre) {
  const PartitionEdge edge{
      {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(4, 9), point<ArtworkFrame>(6, -9), point<ArtworkFrame>(10, 1)}};
  const Polyline<ArtworkFrame> path = flattened(edge);
  const Cubic cubic{PlanePoint{0, 0}, {4, 9}, {6, -9}, {10, 1}};
  double worst = 0;
  for (int k = 0; k <= 2000; ++k) {
    const PlanePoint p = at(cubic, k / 2000.0);
    double nearest = 1e9;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double ax = path[i - 1].x.count(), ay = path[i - 1].y.count();
      const double ux = path[i].x.count() - ax, uy = path[i].y.count() - ay;
      const double t = std::clamp(((p.x - ax) * ux + (p.y - ay) * uy) / (ux * ux + uy * uy), 0.0, 1.0);
      nearest = std::min(nearest, std::hypot(p.x - ax - t * ux, p.y - ay - t * uy));
    }
    worst = std::max(worst, nearest);
  }
  EXPECT_LE(worst, kFlatness.count());
  EXPECT_GT(worst, kFlatness.count() / 20) << "far more points than are needed";
}

// From samples to the nearest point between them.
double distance_to(const Cubic& cubic, const PlanePoint& p) {
  const auto away = [&](double t) {
    const PlanePoint q = at(cubic, std::clamp(t, 0.0, 1.0));
    return std::hypot(p.x - q.x, p.y - q.y);
  };
  constexpr double kStep = 0.01;
  double best = 0;
  for (double t = kStep; t < 1 + kStep / 2; t += kStep)
    if (away(t) < away(best)) best = t;
  double low = best - kStep, high = best + kStep;
  for (int k = 0; k < 60; ++k) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (away(a) < away(b) ? high : low) = away(a) < away(b) ? b : a;
  }
  return std::min(away(low), away(best));
}

RC_GTEST_PROP(BezierFit, StaysWithinItsToleranceAndKeepsTheEnds, ()) {
  const auto wave = *rc::gen::inRange(3, 30), phase = *rc::gen::inRange(0, 100);
  const double height = *rc::gen::inRange(0, 30) / 10.0, tolerance = *rc::gen::inRange(1, 20) / 100.0;
  const auto smoothness = *rc::gen::element(Smoothness::kG0, Smoothness::kG1);
  std::vector<PlanePoint> path;
  const int count = *rc::gen::inRange(2, 120);
  for (int i = 0; i <= count; ++i) path.push_back({i * 0.1, height * std::sin((i + phase) * 0.1 * 6.283 / wave)});
  const std::vector<Cubic> cubics = fit_cubics(path, tolerance, smoothness);
  RC_ASSERT(cubics.front()[0] == path.front());
  RC_ASSERT(cubics.back()[3] == path.back());
  for (std::size_t i = 1; i < cubics.size(); ++i) RC_ASSERT(cubics[i][0] == cubics[i - 1][3]);
  for (const PlanePoint& p : path) {
    double nearest = 1e9;
    for (const Cubic& cubic : cubics) nearest = std::min(nearest, distance_to(cubic, p));
    RC_ASSERT(nearest <= tolerance + 1e-9);
  }
}

TEST(BezierFit, FollowsAQuarterOfACircleByOneCubic) {
  std::vector<PlanePoint> path;
  for (int i = 0; i <= 90; ++i) path.push_back({10 * std::cos(i * kPi / 180), 10 * std::sin(i * kPi / 180)});
  EXPECT_EQ(fit_cubics(path, 0.05, Smoothness::kG0).size(), 1U);
  EXPECT_EQ(fit_cubics(path, 0.05, Smoothness::kG1).size(), 1U);
}

TEST(BezierFit, GoesOnInTheSameDirectionAtJointsWhereItIsToBeSmooth) {
  std::vector<PlanePoint> path;
  for (int i = 0; i <= 100; ++i) path.push_back({i * 0.2, 2 * std::sin(i * 0.13)});
  const std::vector<Cubic> cubics = fit_cubics(path, 0.02, Smoothness::kG1);
  ASSERT_GT(cubics.size(), 1U);
  for (std::size_t i = 1; i < cubics.size(); ++i) {
    const Cubic &a = cubics[i - 1], &b = cubics[i];
    const double before = std::atan2(a[3].y - a[2].y, a[3].x - a[2].x);
    EXPECT_NEAR(before, std::atan2(b[1].y - b[0].y, b[1].x - b[0].x), 1e-9);
  }
}

Ring<ArtworkFrame> ring(std::initializer_list<std::pair<double, double>> points) {
  Ring<ArtworkFrame> out;
  for (const auto& [x, y] : points) out.push_back(point<ArtworkFrame>(x, y));
  return out;
}

TEST(Fabrication, NamesWhatIsWrongWithAPiece) {
  const FabricationLimits limits;  // 1.5 mm
  EXPECT_EQ(fault_of(ring({{0, 0}, {5, 0}, {5, 5}, {0, 5}}), limits), std::nullopt);
  EXPECT_EQ(fault_of(ring({{0, 0}, {1.4, 0}, {1.4, 9}, {0, 9}}), limits), FabricationFault::kThin);
  EXPECT_EQ(fault_of(ring({{0, 0}, {1.9, 0}, {1.9, 1.9}, {0, 1.9}}), limits), FabricationFault::kTooSmall);
  EXPECT_EQ(fault_of(ring({{0, 0}, {5, 5}, {5, 0}, {0, 5}}), limits), FabricationFault::kCrossesItself);
  // Two squares joined by a bridge of 1 mm, and of 2 mm.
  const auto dumbbell = [](double half) {
    return ring({{0, 0},
                 {4, 0},
                 {4, 2 - half},
                 {8, 2 - half},
                 {8, 0},
                 {12, 0},
                 {12, 4},
                 {8, 4},
                 {8, 2 + half},
                 {4, 2 + half},
                 {4, 4},
                 {0, 4}});
  };
  EXPECT_EQ(fault_of(dumbbell(0.5), limits), FabricationFault::kNeck);
  EXPECT_EQ(fault_of(dumbbell(1), limits), std::nullopt);
  // A triangle's tips: of 50 degrees, and of 30.
  const auto tip = [](double degrees_wide) {
    const double half = 10 * std::tan(degrees_wide / 2 * kPi / 180);
    return ring({{0, 0}, {10, -half}, {10, half}});
  };
  EXPECT_EQ(fault_of(tip(50), limits), std::nullopt);
  std::vector<Point<ArtworkFrame>> places;
  EXPECT_EQ(fault_of(tip(30), limits, &places), FabricationFault::kThin);
  ASSERT_FALSE(places.empty());
  for (const auto& p : places) EXPECT_LT(p.x.count(), 2) << "not at the tip";
}

}  // namespace
}  // namespace veneer::planner
