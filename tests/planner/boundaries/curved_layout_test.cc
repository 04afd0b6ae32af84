// Curves beside the lines that they stand for.
#include "planner/boundaries/curved_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/boundaries/cut_lines.h"

namespace veneer::planner {
namespace {

constexpr double kCell = 32, kCutReach = 12;  // pixels, of which there are four in a millimetre
constexpr int kCells = 4;                     // patches
const PixelGrid kCurveGrid{ScanResolution{4}, Millimetres(kCells* kCell / 4)};

CutLines straight_lines() {
  std::vector<PixelRectangle> cells;
  for (int r = 0; r < kCells; ++r)
    for (int c = 0; c < kCells; ++c) cells.push_back({c * kCell, r * kCell, (c + 1) * kCell, (r + 1) * kCell});
  const auto pixels = static_cast<int>(kCells * kCell);
  return cut_lines(cells, kCells * kCell, kCells * kCell, {pixels, pixels}, kCutReach);
}

// What nobody knows beforehand, as wide as a few pixels.
std::vector<FaceCost> random_costs(std::uint64_t seed) {
  cv::RNG random(seed);
  const auto pixels = static_cast<int>(kCells * kCell);
  std::vector<FaceCost> out;
  for (int f = 0; f < kCells * kCells; ++f) {
    cv::Mat cost(pixels, pixels, CV_32FC1);
    random.fill(cost, cv::RNG::UNIFORM, 0, 1);
    cv::GaussianBlur(cost, cost, {}, 2);
    out.push_back({cv::Rect(0, 0, pixels, pixels), cost});
  }
  return out;
}

// A Bezier segment of an edge as a polyline, mm, and what it lies within.
struct Stretch {
  static constexpr int kSteps = 400;
  std::array<cv::Point2d, kSteps + 1> points;
  cv::Point2d least{1e9, 1e9}, most{-1e9, -1e9};

  double to_box(const cv::Point2d& p) const {
    return std::hypot(std::max({least.x - p.x, p.x - most.x, 0.0}), std::max({least.y - p.y, p.y - most.y, 0.0}));
  }
  double to_line(const cv::Point2d& p) const {
    double square = 1e18;
    const cv::Point2d* from = points.data();
    for (const cv::Point2d* to = from + 1; to <= points.data() + kSteps; from = to++) {
      const double ux = to->x - from->x, uy = to->y - from->y, ax = p.x - from->x, ay = p.y - from->y;
      const double length = ux * ux + uy * uy, along = ax * ux + ay * uy;
      const double t = along <= 0 ? 0 : along >= length ? 1 : along / length, dx = ax - t * ux, dy = ay - t * uy;
      const double here = dx * dx + dy * dy;
      if (here < square) square = here;
    }
    return std::sqrt(square);
  }
};

std::vector<Stretch> stretches_of(const Partition& layout) {
  std::vector<Stretch> out;
  for (const PartitionEdge& edge : layout.edges)
    for (std::size_t s = 0; s < edge.segments(); ++s) {
      const auto plane = [&](std::size_t i) {
        return PlanePoint{edge.curve[3 * s + i].x.count(), edge.curve[3 * s + i].y.count()};
      };
      Stretch& stretch = out.emplace_back();
      for (int k = 0; k <= Stretch::kSteps; ++k) {
        const PlanePoint p = at({plane(0), plane(1), plane(2), plane(3)}, k / static_cast<double>(Stretch::kSteps));
        stretch.points.at(static_cast<std::size_t>(k)) = {p.x, p.y};
        stretch.least = {std::min(stretch.least.x, p.x), std::min(stretch.least.y, p.y)};
        stretch.most = {std::max(stretch.most.x, p.x), std::max(stretch.most.y, p.y)};
      }
    }
  return out;
}

// How far the points of lines, a pixel apart, lie from the nearest edge of a layout, mm.
double farthest_from(const CutLines& lines, const Partition& layout) {
  const std::vector<Stretch> stretches = stretches_of(layout);
  double most = 0;
  for (const CutLine& line : lines.lines)
    for (double along = line.begin + 0.5; along < line.end; along += 1) {
      const double x = line.upright ? line(along) : along, y = line.upright ? along : line(along);
      const cv::Point2d p(kCurveGrid.resolution.to_mm(Pixels(x)).count(),
                          (kCurveGrid.height - kCurveGrid.resolution.to_mm(Pixels(y))).count());
      double nearest = 1e9;
      for (const Stretch& stretch : stretches)
        if (stretch.to_box(p) < nearest) nearest = std::min(nearest, stretch.to_line(p));
      most = std::max(most, nearest);
    }
  return most;
}

constexpr double kBulge = 1e-4;  // mm by which a curve may bulge between points that are drawn of it

TEST(CurvedLayout, LiesWithinTheToleranceOfSmoothLines) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const Smoothness smoothness : {Smoothness::kG0, Smoothness::kG1}) {
      CutLines lines = straight_lines();
      const std::vector<FaceCost> costs = random_costs(seed);
      const CutOptions options{kCutReach, 8, 3, 0};
      reroute_all(lines, costs, options, 2);
      smooth_all(lines, costs, options, 3, 0.3, 2);
      const Partition layout = curved_layout(lines, kCurveGrid.height, kCurveGrid, smoothness);
      EXPECT_LE(farthest_from(lines, layout), kFitTolerance.count() + kBulge) << seed;
    }
}

// A pixel is a quarter of a millimetre here: cuts that go aside by whole ones are followed as closely.
TEST(CurvedLayout, LiesWithinTheToleranceOfThePixelsCutItself) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    CutLines lines = straight_lines();
    reroute_all(lines, random_costs(seed), {kCutReach, 8, 3, 0}, 2);
    const Partition layout = curved_layout(lines, kCurveGrid.height, kCurveGrid, Smoothness::kG0);
    EXPECT_LE(farthest_from(lines, layout), kFitTolerance.count() + kBulge) << seed;
  }
}

}  // namespace
}  // namespace veneer::planner
