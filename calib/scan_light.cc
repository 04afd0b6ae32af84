#include "calib/scan_light.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "calib/line_pixels.h"

namespace veneer::calib {
namespace {

constexpr int kDarkestLid = 215;  // when nothing of the scan is as bright, the board covers the glass
constexpr int kUsualLid = 245;
constexpr double kUsualBlurPx = 0.65;  // sigma, pixel aperture included, of flatbeds at their rated resolution
constexpr double kReach = 0.6;         // mm to both sides of an edge

// A step from wood to lid, each with its own light and the lid's with a curved shade, blurred.
double edge_misfit(const std::vector<std::pair<double, double>>& samples, double place, double blur) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd basis(n, 5);
  Eigen::VectorXd seen(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [d, value] = samples[static_cast<std::size_t>(i)];
    const double t = d - place, lid = 0.5 * (1 + std::erf(t / (blur * std::sqrt(2.0))));
    basis.row(i) << 1 - lid, (1 - lid) * t, lid, lid * t, lid * t * t;
    seen[i] = value;
  }
  const Eigen::VectorXd levels = (basis.transpose() * basis).ldlt().solve(basis.transpose() * seen);
  return (basis * levels - seen).squaredNorm();
}

using Samples = std::vector<std::pair<double, double>>;

// Brightness against the distance from the edge, rising.
Samples sample_edge(const cv::Mat& scan, ScanResolution resolution, const FoundLine& edge, double begin, double end) {
  constexpr int kCells = 60;
  std::array<double, kCells> sum{}, place{}, weight{};
  across(scan, resolution, in_pixels(edge, resolution), begin, end, kReach, [&](const cv::Vec3b& v, double d) {
    const auto i = static_cast<std::size_t>(std::clamp((d + kReach) / (2 * kReach) * kCells, 0.0, kCells - 1.0));
    sum[i] += v[0], place[i] += d, weight[i] += 1;  // blue tells wood from lid best
  });
  Samples samples;
  for (std::size_t i = 0; i < kCells; ++i)
    if (weight[i] > 3) samples.emplace_back(place[i] / weight[i], sum[i] / weight[i]);
  return samples;
}

double place_of(const Samples& samples, double blur) {
  double best = 0, least = 1e300;
  for (double at = -0.3; at <= 0.3; at += 0.03) {
    const double m = edge_misfit(samples, at, blur);
    if (m < least) least = m, best = at;
  }
  return golden(best - 0.04, best + 0.04, 1e-3, [&](double at) { return edge_misfit(samples, at, blur); });
}

// The blur at one straight edge; nothing when it is no clean step.
std::optional<double> blur_at(const cv::Mat& scan, ScanResolution resolution, const FoundLine& rough) {
  constexpr int kParts = 12;
  std::vector<double> at, off;
  for (int part = 0; part < kParts; ++part) {
    const double begin = 0.1 + 0.8 * part / kParts, end = 0.1 + 0.8 * (part + 1) / kParts;
    const Samples samples = sample_edge(scan, resolution, rough, begin, end);
    if (samples.size() < 8) return std::nullopt;
    at.push_back((begin + end) / 2), off.push_back(place_of(samples, 0.06));
  }
  const Samples samples = sample_edge(scan, resolution, straightened(rough, resolution, at, off), 0.1, 0.9);
  if (samples.size() < 12) return std::nullopt;
  double blur = 0.06, place = 0;
  for (int round = 0; round < 3; ++round) {
    place = place_of(samples, blur);
    blur = golden(0.01, 0.2, 1e-3, [&](double b) { return edge_misfit(samples, place, b); });
  }
  const double rms = std::sqrt(edge_misfit(samples, place, blur) / static_cast<double>(samples.size()));
  const double step = std::abs(samples.front().second - samples.back().second);
  if (step < 30 || rms > 0.05 * step) return std::nullopt;
  return blur;
}

}  // namespace

double scan_blur(const cv::Mat& scan, ScanResolution resolution, const std::array<double, 3>& lid) {
  const double px = 1 / resolution.px_per_mm, usual = kUsualBlurPx * px;
  cv::Mat blue, wood;
  cv::extractChannel(scan, blue, 0);
  cv::medianBlur(blue < 0.88 * lid[0], wood, 5);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(wood, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<double> blurs;
  for (const auto& contour : contours) {
    if (cv::contourArea(contour) < 400 * resolution.px_per_mm * resolution.px_per_mm) continue;
    std::vector<cv::Point> corners;
    cv::approxPolyDP(contour, corners, 0.4 * resolution.px_per_mm, true);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const cv::Point a = corners[i], b = corners[(i + 1) % corners.size()];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      const auto at_border = [&](const cv::Point& p) {
        return p.x < 8 || p.y < 8 || p.x > scan.cols - 9 || p.y > scan.rows - 9;
      };
      if (length < 15 * resolution.px_per_mm || (at_border(a) && at_border(b) && (a.x == b.x || a.y == b.y))) continue;
      // findContours counts a pixel's centre as 0.
      const auto place = [&](const cv::Point& p) {
        return Point<SlitFrame>{resolution.to_mm(Pixels(p.x + 0.5)), -resolution.to_mm(Pixels(p.y + 0.5))};
      };
      // Wood lies on one side of the contour for all of them; the step must rise with the distance.
      FoundLine edge{0, place(a), place(b)};
      const Samples across_edge = sample_edge(scan, resolution, edge, 0.3, 0.7);
      if (across_edge.empty()) continue;
      if (across_edge.front().second > across_edge.back().second) std::swap(edge.from, edge.to);
      if (const auto blur = blur_at(scan, resolution, edge)) blurs.push_back(*blur);
    }
  }
  if (blurs.empty()) return usual;
  std::nth_element(blurs.begin(), blurs.begin() + static_cast<std::ptrdiff_t>(blurs.size() / 2), blurs.end());
  return std::clamp(blurs[blurs.size() / 2], 0.7 * usual, 1.5 * usual);
}

std::array<double, 3> lid_colour(const cv::Mat& scan) {
  std::array<std::array<std::size_t, 256>, 3> histogram{};
  std::size_t pixels = 0;
  for (int r = 0; r < scan.rows; r += 4) {
    const auto* row = scan.ptr<cv::Vec3b>(r);
    for (int c = 0; c < scan.cols; c += 4, ++pixels)
      for (int k = 0; k < 3; ++k) ++histogram[static_cast<std::size_t>(k)][row[c][k]];
  }
  std::array<double, 3> lid{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::size_t above = 0;
    int level = 255;
    while (level > 0 && (above += histogram[k][static_cast<std::size_t>(level)]) < pixels / 500) --level;
    lid[k] = level < kDarkestLid ? kUsualLid : level;
  }
  return lid;
}

}  // namespace veneer::calib
