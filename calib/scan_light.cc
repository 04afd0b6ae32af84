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
// Sigma of flatbeds at their rated resolution, pixel aperture included, and of a sawn edge.
constexpr double kUsualBlurPx = 0.62, kUsualBlurMm = 0.02;
constexpr double kChordMm = 16;  // of an edge, looked at as straight
constexpr double kReach = 0.4;   // mm to both sides of an edge

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
  across(scan, resolution, in_pixels(edge, resolution), begin, end, kReach, [&](const cv::Vec3b& v, double d, double) {
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
  for (int step = -10; step <= 10; ++step) {
    const double at = 0.03 * step;
    const double m = edge_misfit(samples, at, blur);
    if (m < least) least = m, best = at;
  }
  return golden_section_minimum(best - 0.04, best + 0.04, 1e-3,
                                [&](double at) { return edge_misfit(samples, at, blur); });
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
    blur = golden_section_minimum(0.01, 0.2, 1e-3, [&](double b) { return edge_misfit(samples, place, b); });
  }
  const double rms = std::sqrt(edge_misfit(samples, place, blur) / static_cast<double>(samples.size()));
  const double step = std::abs(samples.front().second - samples.back().second);
  if (step < 30 || rms > 0.05 * step) return std::nullopt;
  return blur;
}

// The chord of a contour between two of its points, if the contour is straight there and inside the picture.
std::optional<FoundLine> straight_chord(const std::vector<cv::Point>& contour, std::size_t first, std::size_t last,
                                        cv::Size picture, ScanResolution resolution) {
  constexpr int kBorder = 8;
  const cv::Point a = contour[first], b = contour[last];
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  if (length < 0.6 * kChordMm * resolution.px_per_mm) return std::nullopt;
  for (std::size_t i = first; i <= last; ++i) {
    const cv::Point p = contour[i];
    if (p.x < kBorder || p.y < kBorder || p.x >= picture.width - kBorder || p.y >= picture.height - kBorder) return {};
    const double off = ((p.x - a.x) * (b.y - a.y) - (p.y - a.y) * (b.x - a.x)) / length;
    if (std::abs(off) > 0.15 * resolution.px_per_mm) return std::nullopt;
  }
  // findContours counts a pixel's centre as 0, and walks with the wood always on the same side.
  const auto place = [&](const cv::Point& p) {
    return Point<SlitFrame>{resolution.to_mm(Pixels(p.x + 0.5)), -resolution.to_mm(Pixels(p.y + 0.5))};
  };
  return FoundLine{0, place(b), place(a)};
}

}  // namespace

ScanBlur scan_blur(const cv::Mat& scan, ScanResolution resolution, const std::array<double, 3>& lid) {
  const double usual = std::hypot(kUsualBlurPx / resolution.px_per_mm, kUsualBlurMm);
  cv::Mat blue, wood;
  cv::extractChannel(scan, blue, 0);
  cv::medianBlur(blue < 0.88 * lid[0], wood, 5);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(wood, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<double> blurs;
  for (const auto& contour : contours) {
    if (cv::contourArea(contour) < 400 * resolution.px_per_mm * resolution.px_per_mm) continue;
    // Short chords: over a long edge the scanner's own warp would look like blur.
    const auto step = static_cast<std::size_t>(kChordMm * resolution.px_per_mm);
    for (std::size_t k = 0; k + step < contour.size(); k += step) {
      if (const auto edge = straight_chord(contour, k, k + step, scan.size(), resolution)) {
        if (const auto blur = blur_at(scan, resolution, *edge)) blurs.push_back(*blur);
      }
    }
  }
  if (blurs.size() < 3) return {usual, 0.15};
  std::nth_element(blurs.begin(), blurs.begin() + static_cast<std::ptrdiff_t>(blurs.size() / 2), blurs.end());
  return {std::clamp(blurs[blurs.size() / 2], 0.6 * usual, 2.5 * usual), 0.12};
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
