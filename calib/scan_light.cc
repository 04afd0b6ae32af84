#include "calib/scan_light.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "calib/line_pixels.h"

namespace veneer::calib {
namespace {

constexpr int kDarkestLid = 215;  // when nothing of the scan is as bright, the board covers the glass
constexpr int kUsualLid = 245;
// Sigma of flatbeds at their rated resolution, pixel aperture included, and of a sawn edge; how much narrower the core
// is, and how much of the light lies in the tails.
constexpr double kUsualBlurPx = 0.62, kUsualBlurMm = 0.02, kUsualCore = 0.61, kUsualTails = 0.58;
constexpr double kChordMm = 16;                        // of an edge, looked at as straight
constexpr double kReach = 0.4;                         // mm to both sides of an edge
constexpr double kTrust = 0.012, kLittleTrust = 0.02;  // mm, in what a slit's walls may add to a measured, a usual blur

// A step from wood to lid, each with its own light and the lid's with a curved shade, blurred.
double edge_misfit(const std::vector<std::pair<double, double>>& samples, double place, const LineSpread& spread) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd basis(n, 5);
  Eigen::VectorXd seen(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [d, value] = samples[static_cast<std::size_t>(i)];
    const double t = d - place, lid = spread.below(t);
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

double place_of(const Samples& samples, const LineSpread& spread) {
  double best = 0, least = 1e300;
  for (int step = -10; step <= 10; ++step) {
    const double at = 0.03 * step;
    const double m = edge_misfit(samples, at, spread);
    if (m < least) least = m, best = at;
  }
  return golden_section_minimum(best - 0.04, best + 0.04, 1e-3,
                                [&](double at) { return edge_misfit(samples, at, spread); });
}

struct SeenEdge {
  Samples samples;
  double place = 0, step = 0;  // grey levels from wood to lid
};

// One straight edge; nothing when it is no clean step.
std::optional<SeenEdge> edge_at(const cv::Mat& scan, ScanResolution resolution, const FoundLine& rough) {
  constexpr int kParts = 12;
  const LineSpread usual{0.06, 0};
  std::vector<double> at, off;
  for (int part = 0; part < kParts; ++part) {
    const double begin = 0.1 + 0.8 * part / kParts, end = 0.1 + 0.8 * (part + 1) / kParts;
    const Samples samples = sample_edge(scan, resolution, rough, begin, end);
    if (samples.size() < 8) return std::nullopt;
    at.push_back((begin + end) / 2), off.push_back(place_of(samples, usual));
  }
  SeenEdge edge;
  edge.samples = sample_edge(scan, resolution, straightened(rough, resolution, at, off), 0.1, 0.9);
  if (edge.samples.size() < 12) return std::nullopt;
  // Judged by the blur that fits it best: a step that is softer or sharper than usual is a clean one too.
  LineSpread own = usual;
  for (int round = 0; round < 2; ++round) {
    edge.place = place_of(edge.samples, own);
    own.sigma = golden_section_minimum(0.01, 0.2, 1e-3, [&](double s) {
      return edge_misfit(edge.samples, edge.place, {s, 0});
    });
  }
  edge.step = std::abs(edge.samples.front().second - edge.samples.back().second);
  const double rms = std::sqrt(edge_misfit(edge.samples, edge.place, own) / static_cast<double>(edge.samples.size()));
  if (edge.step < 30 || rms > 0.05 * edge.step) return std::nullopt;
  return edge;
}

// The spread that fits all edges best, each with its own levels. Tails are believed as far as the edges show them:
// grain beside an edge looks like a little of them, or of their contrary.
LineSpread spread_of(std::vector<SeenEdge>& edges, double usual) {
  constexpr double kTails = 0.3;    // one sigma of what is expected
  constexpr double kAlikeBins = 6;  // neighbours share their grain
  const auto misfit = [&](const LineSpread& spread) {
    double sum = 0;
    for (const SeenEdge& e : edges) sum += edge_misfit(e.samples, e.place, spread) / (e.step * e.step);
    return sum;
  };
  const auto with_part = [&](double part) {
    const auto of_sigma = [&](double sigma) { return misfit({sigma, part}); };
    return LineSpread{golden_section_minimum(0.2 * usual, 3 * usual, 5e-4, of_sigma), part};
  };
  double bins = 0;
  for (const SeenEdge& e : edges) bins += static_cast<double>(e.samples.size());
  LineSpread best{usual, 0};
  for (int round = 0; round < 3; ++round) {
    for (SeenEdge& e : edges) e.place = place_of(e.samples, best);
    const double noise = misfit(best) / bins * kAlikeBins;
    best = with_part(golden_section_minimum(-0.3, 0.9, 5e-3, [&](double part) {
      return misfit(with_part(part)) / noise + part * part / (kTails * kTails);
    }));
  }
  return best;
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

double LineSpread::below(double x, double roughness) const {
  const auto gaussian = [&](double s) { return 0.5 * (1 + std::erf(x / (std::hypot(s, roughness) * std::sqrt(2.0)))); };
  return (1 - wide_part) * gaussian(sigma) + wide_part * gaussian(kWider * sigma);
}

double LineSpread::sum_below(double x, double roughness) const {
  const auto gaussian = [&](double s) {
    const double wide = std::hypot(s, roughness), t = x / wide;
    return x * 0.5 * (1 + std::erf(t / std::sqrt(2.0))) + wide * std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  };
  return (1 - wide_part) * gaussian(sigma) + wide_part * gaussian(kWider * sigma);
}

namespace {

// Where the sheet lies, by its blue. Beside it the lid lies in the sheet's own shadow, dimmed by an eighth and more: a
// level near the lid's would follow that shadow's edge, so it is one nearer to the wood's.
cv::Mat wood_of(const cv::Mat& blue, double lid) {
  constexpr double kSurelyDarker = 0.88, kTowardsLid = 0.4;
  std::vector<unsigned char> darker;
  for (int r = 0; r < blue.rows; r += 4) {
    const auto* row = blue.ptr<unsigned char>(r);
    for (int c = 0; c < blue.cols; c += 4)
      if (row[c] < kSurelyDarker * lid) darker.push_back(row[c]);
  }
  if (darker.empty()) return cv::Mat::zeros(blue.size(), CV_8U);
  const auto middle = darker.begin() + static_cast<std::ptrdiff_t>(darker.size() / 2);
  std::nth_element(darker.begin(), middle, darker.end());
  cv::Mat wood;
  cv::medianBlur(blue < *middle + kTowardsLid * (lid - *middle), wood, 5);
  return wood;
}

}  // namespace

ScanBlur scan_blur(const cv::Mat& scan, ScanResolution resolution, const std::array<double, 3>& lid) {
  const double usual = std::hypot(kUsualBlurPx / resolution.px_per_mm, kUsualBlurMm);
  cv::Mat blue;
  cv::extractChannel(scan, blue, 0);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(wood_of(blue, lid[0]), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<SeenEdge> edges;
  for (const auto& contour : contours) {
    if (cv::contourArea(contour) < 400 * resolution.px_per_mm * resolution.px_per_mm) continue;
    // Short chords: over a long edge the scanner's own warp would look like blur.
    const auto step = static_cast<std::size_t>(kChordMm * resolution.px_per_mm);
    for (std::size_t k = 0; k + step < contour.size(); k += step) {
      if (const auto edge = straight_chord(contour, k, k + step, scan.size(), resolution)) {
        if (auto seen = edge_at(scan, resolution, *edge)) edges.push_back(std::move(*seen));
      }
    }
  }
  if (edges.size() < 3) return {{kUsualCore * usual, kUsualTails}, kLittleTrust};
  return {spread_of(edges, usual), kTrust};
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
