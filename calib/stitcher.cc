#include "calib/stitcher.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::calib {
namespace {

constexpr int kNode = 16;  // px between nodes; in between the scanner's warp is straight to 0.1 um
constexpr int kBand = 128;
constexpr double kScanRim = 2;  // px at a scan's rim that cubic interpolation cannot use
constexpr int kMaxPixels = 30000;

// Our pixel centres are at +0.5, OpenCV's at 0.
constexpr double opencv_from_scan(double px) { return px - 0.5; }

// Places in one scan (our convention) at every node of the map.
struct Lattice {
  cv::Mat nodes;  // CV_64FC2

  cv::Vec2d at(double column, double row) const {
    const double x = column / kNode, y = row / kNode;
    const int c = std::min(static_cast<int>(x), nodes.cols - 2), r = std::min(static_cast<int>(y), nodes.rows - 2);
    const double fx = x - c, fy = y - r;
    const auto* upper = nodes.ptr<cv::Vec2d>(r) + c;
    const auto* lower = nodes.ptr<cv::Vec2d>(r + 1) + c;
    return (upper[0] * (1 - fx) + upper[1] * fx) * (1 - fy) + (lower[0] * (1 - fx) + lower[1] * fx) * fy;
  }
};

Lattice lattice_of(const ScanMap& panel_from_scan, const Raster<PanelFrame>& map) {
  Lattice lattice{cv::Mat(map.pixels.rows / kNode + 2, map.pixels.cols / kNode + 2, CV_64FC2)};
  for (int r = 0; r < lattice.nodes.rows; ++r)
    for (int c = 0; c < lattice.nodes.cols; ++c) {
      const Point<ScanFrame> p = panel_from_scan.inverse(map.from_pixels(c * kNode, r * kNode));
      lattice.nodes.at<cv::Vec2d>(r, c) = {p.x.count(), p.y.count()};
    }
  return lattice;
}

// How far inside the scan a place lies, in pixels.
double depth_in(const cv::Mat& scan, const cv::Vec2d& p) {
  return std::min({p[0], p[1], scan.cols - p[0], scan.rows - p[1]}) - kScanRim;
}

using Gain = std::array<double, 3>;

// Factors that make the tiles agree where they overlap: medians of the ratios of 2 mm means, in least squares.
std::vector<Gain> exposure_gains(std::span<const StitchTile> tiles, const std::vector<Lattice>& lattices,
                                 const cv::Size& size, ScanResolution resolution) {
  const std::size_t n = tiles.size();
  std::vector<Gain> gains(n, Gain{1, 1, 1});
  if (n < 2) return gains;
  const int step = std::max(8, static_cast<int>(2 * resolution.px_per_mm)), half = step / 3;
  std::vector<std::array<std::vector<double>, 3>> ratios(n * n);
  for (int r = step; r < size.height - step; r += step)
    for (int c = step; c < size.width - step; c += step) {
      std::vector<std::pair<std::size_t, cv::Scalar>> seen;
      for (std::size_t t = 0; t < n; ++t) {
        const cv::Vec2d p = lattices[t].at(c, r);
        if (depth_in(tiles[t].pixels, p) < 2 * half) continue;
        const cv::Rect box(static_cast<int>(p[0]) - half, static_cast<int>(p[1]) - half, 2 * half, 2 * half);
        seen.emplace_back(t, cv::mean(tiles[t].pixels(box)));
      }
      for (std::size_t i = 0; i + 1 < seen.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
          const double a = seen[i].second[static_cast<int>(k)], b = seen[i + 1].second[static_cast<int>(k)];
          if (a > 30 && b > 30 && a < 250 && b < 250) ratios[seen[i].first * n + seen[i + 1].first][k].push_back(a / b);
        }
    }
  for (std::size_t k = 0; k < 3; ++k) {
    Eigen::MatrixXd normal =
        Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n)) * 1e-3;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b) {
        auto& all = ratios[a * n + b][k];
        if (all.size() < 20) continue;
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
        const double log_ratio = std::log(all[all.size() / 2]);  // gain b / gain a
        const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
        normal(i, i) += 1, normal(j, j) += 1, normal(i, j) -= 1, normal(j, i) -= 1;
        right(i) -= log_ratio, right(j) += log_ratio;
      }
    const Eigen::VectorXd logs = normal.ldlt().solve(right);
    for (std::size_t t = 0; t < n; ++t) gains[t][k] = std::exp(logs(static_cast<Eigen::Index>(t)));
  }
  return gains;
}

// Rows [from, to) of the map. Near a seam each tile weighs by how much deeper a place lies in it than in any other.
void fill_band(cv::Mat& out, int from, int to, std::span<const StitchTile> tiles, const std::vector<Lattice>& lattices,
               const std::vector<Gain>& gains, double feather_px) {
  const int rows = to - from, columns = out.cols;
  std::vector<cv::Mat> depths, pictures;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    cv::Mat x(rows, columns, CV_32FC1), y(rows, columns, CV_32FC1), depth(rows, columns, CV_32FC1);
    bool any = false;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        const cv::Vec2d p = lattices[t].at(c + 0.5, from + r + 0.5);
        x.at<float>(r, c) = static_cast<float>(opencv_from_scan(p[0]));
        y.at<float>(r, c) = static_cast<float>(opencv_from_scan(p[1]));
        const double d = depth_in(tiles[t].pixels, p);
        depth.at<float>(r, c) = static_cast<float>(d);
        any = any || d > 0;
      }
    cv::Mat picture;
    if (any) cv::remap(tiles[t].pixels, picture, x, y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    depths.push_back(depth), pictures.push_back(picture);
  }
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      double total = 0;
      std::array<double, 3> sum{};
      for (std::size_t t = 0; t < tiles.size(); ++t) {
        const double depth = depths[t].at<float>(r, c);
        if (depth <= 0) continue;
        double deepest_other = 0;
        for (std::size_t o = 0; o < tiles.size(); ++o)
          if (o != t) deepest_other = std::max<double>(deepest_other, depths[o].at<float>(r, c));
        // Where no other tile sees the place it counts fully.
        const double weight =
            deepest_other <= 0 ? 1 : std::clamp(0.5 + (depth - deepest_other) / feather_px, 1e-6, 1.0);
        const auto& pixel = pictures[t].at<cv::Vec3b>(r, c);
        for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * gains[t][k] * pixel[static_cast<int>(k)];
        total += weight;
      }
      auto& pixel = out.at<cv::Vec3b>(from + r, c);
      for (std::size_t k = 0; k < 3; ++k)
        pixel[static_cast<int>(k)] = total > 0 ? cv::saturate_cast<std::uint8_t>(sum[k] / total) : 255;
    }
}

}  // namespace

Result<Raster<PanelFrame>> stitch(std::span<const StitchTile> tiles, const Box<PanelFrame>& area,
                                  const StitchOptions& options) {
  if (tiles.empty()) return Error{ErrorCode::kInvalidArgument, "there is no tile to stitch: scan the panel"};
  for (const StitchTile& tile : tiles)
    if (tile.pixels.type() != CV_8UC3 || tile.pixels.empty())
      return Error{ErrorCode::kInvalidArgument,
                   "a tile to stitch is empty or not an 8 bit colour picture: scan it again"};
  const double columns = std::ceil(options.resolution.to_px(area.width()).count() - 1e-6);
  const double rows = std::ceil(options.resolution.to_px(area.height()).count() - 1e-6);
  if (area.empty() || columns < 1 || rows < 1 || columns > kMaxPixels || rows > kMaxPixels)
    return Error{ErrorCode::kInvalidArgument,
                 "the area to stitch is empty or has a side of more than 30000 pixels: scan at fewer dots per inch"};

  Raster<PanelFrame> map;
  map.pixels.create(static_cast<int>(rows), static_cast<int>(columns), CV_8UC3);
  map.resolution = options.resolution;
  map.origin = area.min;
  std::vector<Lattice> lattices;
  for (const StitchTile& tile : tiles) lattices.push_back(lattice_of(tile.panel_from_scan, map));
  const std::vector<Gain> gains = options.compensate_exposure
                                      ? exposure_gains(tiles, lattices, map.pixels.size(), options.resolution)
                                      : std::vector<Gain>(tiles.size(), Gain{1, 1, 1});
  const double feather_px = std::max(1.0, options.resolution.to_px(options.feather).count());
  const int bands = (map.pixels.rows + kBand - 1) / kBand;
  cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
    for (int band = range.start; band < range.end; ++band)
      fill_band(map.pixels, band * kBand, std::min(map.pixels.rows, (band + 1) * kBand), tiles, lattices, gains,
                feather_px);
  });
  return map;
}

}  // namespace veneer::calib
