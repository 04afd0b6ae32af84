#include "planner/layout/mosaic.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/cancelled.h"
#include "planner/layout/centroidal_voronoi.h"
#include "planner/layout/direction_field.h"
#include "planner/layout/edge_ends.h"
#include "planner/layout/label_regions.h"
#include "planner/layout/quarter_turns.h"

namespace veneer::planner {
namespace {

constexpr double kEdgeWidth = 0.3;   // tiles: how thick edges are drawn that tiles avoid
constexpr double kSmoothing = 0.35;  // tiles: see direction_field()
constexpr double kRough = 0.5;       // pixels: rest of the first iterations, before edges are drawn
constexpr int kClosing = 4;          // iterations without edges, which close the joints (section 6)
constexpr double kLongerEnds = 0.5;  // tiles: so far a loose end cuts cells through that it reaches into
constexpr double kBesideLine = 0.5;  // tiles: an edge that is nearer to a drawn line is what that one traces

// The edges that tiles heed.
cv::Mat edges_of(const cv::Mat& bgr, double tile, const MosaicOptions& options) {
  if (options.lines.empty()) return salient_edges(bgr, tile);
  if (options.lines_only) return options.lines;
  cv::Mat edges = salient_edges(bgr, tile), distance;
  cv::distanceTransform(~options.lines, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  edges.setTo(0, distance < kBesideLine * tile);
  return edges | options.lines;
}

// Scaled so that `count` tiles of these sides fill their raster.
cv::Mat scaled_to(const cv::Mat& sides, int count) {
  double tiles = 0;
  for (int r = 0; r < sides.rows; ++r)
    for (int c = 0; c < sides.cols; ++c) {
      const auto side = static_cast<double>(sides.at<float>(r, c));
      tiles += 1 / (side * side);
    }
  return sides * std::sqrt(tiles / std::max(1, count));
}

// Values in the order of their size, from 0 to 1.
cv::Mat ranks(const cv::Mat& values) {
  std::vector<float> sorted(values.begin<float>(), values.end<float>());
  std::sort(sorted.begin(), sorted.end());
  cv::Mat out(values.size(), CV_32FC1);
  const auto last = static_cast<float>(std::max<std::size_t>(1, sorted.size() - 1));
  for (int r = 0; r < values.rows; ++r)
    for (int c = 0; c < values.cols; ++c) {
      const auto [low, high] = std::equal_range(sorted.begin(), sorted.end(), values.at<float>(r, c));
      out.at<float>(r, c) = static_cast<float>((low - sorted.begin()) + (high - sorted.begin() - 1)) / (2 * last);
    }
  return out;
}

// The field's mean over each label, up to quarter turns.
struct MeanDirection {
  double angle = 0;
  double agreement = 0;  // of the directions: 1 where all are the same, 0 where they cancel out
};
std::vector<MeanDirection> mean_directions(const cv::Mat& labels, std::size_t count, const cv::Mat& angle) {
  struct Sum {
    double cos = 0, sin = 0, pixels = 0;
  };
  std::vector<Sum> sums(count);
  for (int r = 0; r < angle.rows; ++r)
    for (int c = 0; c < angle.cols; ++c) {
      const auto four = 4 * static_cast<double>(angle.at<float>(r, c));
      Sum& sum = sums[static_cast<std::size_t>(labels.at<int>(r, c))];
      sum.cos += std::cos(four), sum.sin += std::sin(four), ++sum.pixels;
    }
  std::vector<MeanDirection> out;
  out.reserve(sums.size());
  for (const Sum& sum : sums)
    out.push_back({std::atan2(sum.sin, sum.cos) / 4, std::hypot(sum.cos, sum.sin) / std::max(1.0, sum.pixels)});
  return out;
}

// How far the field turns within tiles.
double median_deviation(const VoronoiDiagram& diagram, const cv::Mat& angle) {
  const std::vector<MeanDirection> means = mean_directions(diagram.labels, diagram.sites.size(), angle);
  std::vector<double> out;
  for (std::size_t i = 0; i < means.size(); ++i) {
    const PlanePoint& p = diagram.sites[i];
    const float own = angle.at<float>(std::clamp(static_cast<int>(p.y), 0, angle.rows - 1),
                                      std::clamp(static_cast<int>(p.x), 0, angle.cols - 1));
    out.push_back(degrees_apart(static_cast<double>(own), means[i].angle));
  }
  return median(std::move(out));
}

double straddling_share(const cv::Mat& cells, const cv::Mat& edges, double aspect) {
  cv::Mat labels = cells.clone();
  const int count = number_regions(labels);
  cv::Mat inside(labels.size(), CV_8UC1, cv::Scalar(255)), depth;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      const int here = labels.at<int>(r, c);
      if ((c + 1 < labels.cols && labels.at<int>(r, c + 1) != here) ||
          (r + 1 < labels.rows && labels.at<int>(r + 1, c) != here))
        inside.at<std::uint8_t>(r, c) = 0;
    }
  cv::distanceTransform(inside, depth, cv::DIST_L2, cv::DIST_MASK_5);
  std::vector<double> area(static_cast<std::size_t>(count), 0), deep(area);
  for (const bool counting : {false, true})
    for (int r = 0; r < labels.rows; ++r)
      for (int c = 0; c < labels.cols; ++c) {
        const auto i = static_cast<std::size_t>(labels.at<int>(r, c));
        if (!counting)
          ++area[i];
        else if (edges.at<std::uint8_t>(r, c) != 0 &&
                 static_cast<double>(depth.at<float>(r, c)) > kStraddlingDepth * std::sqrt(area[i] / aspect))
          ++deep[i];
      }
  int straddling = 0;
  for (std::size_t i = 0; i < area.size(); ++i) straddling += deep[i] > kStraddlingLength * std::sqrt(area[i]) ? 1 : 0;
  return count > 0 ? static_cast<double>(straddling) / count : 0;
}

}  // namespace

cv::Mat tile_sizes(const cv::Mat& detail, int count, double ratio) {
  const double tile = std::sqrt(static_cast<double>(detail.total()) / std::max(1, count));
  cv::Mat smooth, out;
  cv::GaussianBlur(detail, smooth, {}, std::max(0.8, tile / 2));
  const cv::Mat rank = ranks(smooth);
  cv::exp(rank * -std::log(std::max(1.0, ratio)), out);
  cv::GaussianBlur(out, out, {}, std::max(0.8, tile / 2));
  return scaled_to(out, count);
}

cv::Mat smooth_painted(const cv::Mat& painted, int count) {
  const double tile = std::sqrt(static_cast<double>(painted.total()) / std::max(1, count));
  cv::Mat white;
  painted.convertTo(white, CV_32F, 1.0 / 255);
  // Sizes that jump rest late and badly (section 5.2), and a cell of one size beside one of another leaves a gap.
  cv::GaussianBlur(white, white, {}, std::max(0.8, tile));
  return white;
}

cv::Mat painted_tile_sizes(const cv::Mat& white, int count, double ratio) {
  cv::Mat out;
  cv::exp(white * -std::log(std::max(1.0, ratio)), out);
  return scaled_to(out, count);
}

double cell_deviation(const cv::Mat& labels, const cv::Mat& angle) {
  cv::Mat cells = labels.clone();
  const auto count = static_cast<std::size_t>(number_regions(cells));
  // The corners of the pixels that a cell begins and ends with in each row have the same rectangle as all of them.
  std::vector<std::vector<cv::Point2f>> corners(count);
  for (int r = 0; r < cells.rows; ++r)
    for (int c = 0; c < cells.cols; ++c) {
      const int here = cells.at<int>(r, c);
      const auto i = static_cast<std::size_t>(here);
      const auto x = static_cast<float>(c), y = static_cast<float>(r);
      if (c == 0 || cells.at<int>(r, c - 1) != here) corners[i].insert(corners[i].end(), {{x, y}, {x, y + 1}});
      if (c + 1 == cells.cols || cells.at<int>(r, c + 1) != here)
        corners[i].insert(corners[i].end(), {{x + 1, y}, {x + 1, y + 1}});
    }
  const std::vector<MeanDirection> means = mean_directions(cells, count, angle);
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double turned = static_cast<double>(cv::minAreaRect(corners[i]).angle) * std::numbers::pi / 180;
    out.push_back(degrees_apart(turned, means[i].angle));
  }
  return median(std::move(out));
}

std::vector<PlanePoint> turning_cells(const cv::Mat& labels, const cv::Mat& angle) {
  // Of directions that turn evenly by kTurningDegrees: the sine of x over x, of half of four times that angle.
  constexpr double kHalf = 2 * kTurningDegrees * std::numbers::pi / 180;
  const double agreement = std::sin(kHalf) / kHalf;
  cv::Mat cells = labels.clone();
  const auto count = static_cast<std::size_t>(number_regions(cells));
  const std::vector<MeanDirection> means = mean_directions(cells, count, angle);
  struct Middle {
    double x = 0, y = 0, pixels = 0;
  };
  std::vector<Middle> middles(count);
  for (int r = 0; r < cells.rows; ++r)
    for (int c = 0; c < cells.cols; ++c) {
      Middle& it = middles[static_cast<std::size_t>(cells.at<int>(r, c))];
      it.x += c + 0.5, it.y += r + 0.5, ++it.pixels;
    }
  std::vector<PlanePoint> out;
  for (std::size_t i = 0; i < count; ++i)
    if (means[i].agreement < agreement)
      out.push_back({middles[i].x / middles[i].pixels / cells.cols, middles[i].y / middles[i].pixels / cells.rows});
  return out;
}

Result<Mosaic> decorative_mosaic(const cv::Mat& bgr, const cv::Mat& size, const MosaicOptions& options,
                                 const std::stop_token& stop) {
  const double tile = std::sqrt(static_cast<double>(bgr.total()) / std::max(1, options.count));
  const cv::Mat edges = edges_of(bgr, tile, options);
  const DirectionField directions = direction_field(edges, kSmoothing * tile);
  // A square tile needs no more than one of its axes; of a long one it must be known which.
  VoronoiField field{options.aspect == 1 ? directions.angle : directions.across, size, {}};
  VoronoiOptions lloyd{options.count, std::sqrt(options.aspect), kRough, 60, options.seed, options.threads};
  Result<VoronoiDiagram> diagram =
      centroidal_voronoi(sampled_sites(size, options.count, options.seed), field, lloyd, stop);
  if (!diagram.ok()) return diagram.error();
  Mosaic out;
  out.figures.tiles = options.count;
  out.figures.iterations = diagram->iterations;
  // Away from the edges, until sites rest.
  const int thick = std::max(1, static_cast<int>(std::lround(kEdgeWidth * tile)));
  cv::dilate(edges, field.avoid, cv::getStructuringElement(cv::MORPH_ELLIPSE, {thick | 1, thick | 1}));
  lloyd.rest = 0.1, lloyd.most_iterations = 300;
  diagram = centroidal_voronoi(std::move(diagram->sites), field, lloyd, stop);
  if (!diagram.ok()) return diagram.error();
  out.figures.iterations += diagram->iterations;
  out.figures.mean_move_px = diagram->mean_move;
  field.avoid = cv::Mat();
  lloyd.rest = 0, lloyd.most_iterations = kClosing;
  diagram = centroidal_voronoi(std::move(diagram->sites), field, lloyd, stop);
  if (!diagram.ok()) return diagram.error();
  out.figures.iterations += diagram->iterations;
  out.figures.deviation_deg = median_deviation(*diagram, field.angle);
  out.labels = diagram->labels;
  // Cells end at the edges that cut them through, or nearly do, and hang together.
  absorb_stray_parts(out.labels, with_longer_ends(edges, kLongerEnds * tile));
  if (options.with_joints) {
    out.tiles = disjoint_tiles(out.labels, field, options.aspect);
    Result<TileFigures> figures = tile_figures(out.tiles, field.angle, edges, stop);
    if (!figures.ok()) return figures.error();
    out.tile_figures = *figures;
  }
  out.figures.cell_deviation_deg = cell_deviation(out.labels, field.angle);
  out.figures.turning = turning_cells(out.labels, field.angle);
  out.figures.straddling = straddling_share(out.labels, edges, options.aspect);
  if (Status status = unless_cancelled(stop); !status.ok()) return status.error();
  return out;
}

}  // namespace veneer::planner
