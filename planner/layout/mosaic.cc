#include "planner/layout/mosaic.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/layout/centroidal_voronoi.h"
#include "planner/layout/direction_field.h"
#include "planner/layout/label_regions.h"

namespace veneer::planner {
namespace {

constexpr double kEdgeWidth = 0.3;   // tiles: how thick edges are drawn that tiles avoid
constexpr double kSmoothing = 0.35;  // tiles: see direction_field()
constexpr double kRough = 0.5;       // pixels: rest of the first iterations, before edges are drawn
constexpr int kClosing = 4;          // iterations without edges, which close the joints (section 6)
constexpr double kDeepInside = 0.2;  // sides: an edge that runs farther than this inside a tile ...
constexpr double kLong = 0.5;        // sides: ... for so long straddles it

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

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Degrees between two directions that are known up to quarter turns.
double turn_between(double a, double b) {
  constexpr double kQuarter = std::numbers::pi / 2;
  const double turn = std::abs(std::remainder(a - b, kQuarter));
  return turn * 180 / std::numbers::pi;
}

// The field's mean over each label, up to quarter turns.
std::vector<double> mean_angles(const cv::Mat& labels, std::size_t count, const cv::Mat& angle) {
  struct Mean {
    double cos = 0, sin = 0;
  };
  std::vector<Mean> means(count);
  for (int r = 0; r < angle.rows; ++r)
    for (int c = 0; c < angle.cols; ++c) {
      const auto four = 4 * static_cast<double>(angle.at<float>(r, c));
      Mean& mean = means[static_cast<std::size_t>(labels.at<int>(r, c))];
      mean.cos += std::cos(four), mean.sin += std::sin(four);
    }
  std::vector<double> out;
  out.reserve(means.size());
  for (const Mean& mean : means) out.push_back(std::atan2(mean.sin, mean.cos) / 4);
  return out;
}

// How far the field turns within tiles.
double median_deviation(const VoronoiDiagram& diagram, const cv::Mat& angle) {
  const std::vector<double> means = mean_angles(diagram.labels, diagram.sites.size(), angle);
  std::vector<double> out;
  for (std::size_t i = 0; i < means.size(); ++i) {
    const PlanePoint& p = diagram.sites[i];
    const float own = angle.at<float>(std::clamp(static_cast<int>(p.y), 0, angle.rows - 1),
                                      std::clamp(static_cast<int>(p.x), 0, angle.cols - 1));
    out.push_back(turn_between(static_cast<double>(own), means[i]));
  }
  return median(std::move(out));
}

double straddling_share(const cv::Mat& cells, const cv::Mat& edges) {
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
                 static_cast<double>(depth.at<float>(r, c)) > kDeepInside * std::sqrt(area[i]))
          ++deep[i];
      }
  int straddling = 0;
  for (std::size_t i = 0; i < area.size(); ++i) straddling += deep[i] > kLong * std::sqrt(area[i]) ? 1 : 0;
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
  double tiles = 0;
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c) {
      const auto side = static_cast<double>(out.at<float>(r, c));
      tiles += 1 / (side * side);
    }
  return out * std::sqrt(tiles / std::max(1, count));
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
  const std::vector<double> means = mean_angles(cells, count, angle);
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double turned = static_cast<double>(cv::minAreaRect(corners[i]).angle) * std::numbers::pi / 180;
    out.push_back(turn_between(turned, means[i]));
  }
  return median(std::move(out));
}

Result<Mosaic> decorative_mosaic(const cv::Mat& bgr, const cv::Mat& size, const MosaicOptions& options,
                                 const std::stop_token& stop) {
  const double tile = std::sqrt(static_cast<double>(bgr.total()) / std::max(1, options.count));
  const cv::Mat edges = salient_edges(bgr, tile);
  VoronoiField field{direction_field(edges, kSmoothing * tile).angle, size, {}};
  // The field's axis points across edges, and tiles are to lie along them.
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
  // Cells end at the edges that cut them through, and hang together.
  absorb_stray_parts(out.labels, edges);
  out.figures.cell_deviation_deg = cell_deviation(out.labels, field.angle);
  out.figures.straddling = straddling_share(out.labels, edges);
  return out;
}

}  // namespace veneer::planner
