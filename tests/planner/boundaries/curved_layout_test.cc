// Curves beside the lines that they stand for.
#include "planner/boundaries/curved_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
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

double distance_to_path(const Polyline<ArtworkFrame>& path, const Point<ArtworkFrame>& p) {
  double nearest = 1e9;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double ux = (path[i].x - path[i - 1].x).count(), uy = (path[i].y - path[i - 1].y).count();
    const double ax = (p.x - path[i - 1].x).count(), ay = (p.y - path[i - 1].y).count(), length = ux * ux + uy * uy;
    const double t = length > 0 ? std::clamp((ax * ux + ay * uy) / length, 0.0, 1.0) : 0;
    nearest = std::min(nearest, std::hypot(ax - t * ux, ay - t * uy));
  }
  return nearest;
}

// How far the points of lines, a pixel apart, lie from the nearest edge of a layout, mm.
double farthest_from(const CutLines& lines, const Partition& layout) {
  std::vector<Polyline<ArtworkFrame>> paths;
  for (const PartitionEdge& edge : layout.edges) {
    Polyline<ArtworkFrame>& path = paths.emplace_back();
    for (std::size_t s = 0; s < edge.segments(); ++s)
      for (int k = 0; k <= 400; ++k) {
        const auto plane = [&](std::size_t i) {
          return PlanePoint{edge.curve[3 * s + i].x.count(), edge.curve[3 * s + i].y.count()};
        };
        const PlanePoint p = at({plane(0), plane(1), plane(2), plane(3)}, k / 400.0);
        path.push_back(point<ArtworkFrame>(p.x, p.y));
      }
  }
  double most = 0;
  for (const CutLine& line : lines.lines)
    for (double along = line.begin + 0.5; along < line.end; along += 1) {
      const double x = line.upright ? line(along) : along, y = line.upright ? along : line(along);
      const Point<ArtworkFrame> p{kCurveGrid.resolution.to_mm(Pixels(x)),
                                  kCurveGrid.height - kCurveGrid.resolution.to_mm(Pixels(y))};
      double nearest = 1e9;
      for (const Polyline<ArtworkFrame>& path : paths) nearest = std::min(nearest, distance_to_path(path, p));
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
      recut_all(lines, costs, options, 2);
      smooth_all(lines, costs, options, 3, 0.3, 2);
      const Partition layout = curved_layout(lines, kCurveGrid.height, kCurveGrid, smoothness);
      EXPECT_LE(farthest_from(lines, layout), kFitTolerance.count() + kBulge) << seed;
    }
}

// A pixel is a quarter of a millimetre here: cuts that go aside by whole ones are followed as closely.
TEST(CurvedLayout, LiesWithinTheToleranceOfThePixelsCutItself) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    CutLines lines = straight_lines();
    recut_all(lines, random_costs(seed), {kCutReach, 8, 3, 0}, 2);
    const Partition layout = curved_layout(lines, kCurveGrid.height, kCurveGrid, Smoothness::kG0);
    EXPECT_LE(farthest_from(lines, layout), kFitTolerance.count() + kBulge) << seed;
  }
}

}  // namespace
}  // namespace veneer::planner
