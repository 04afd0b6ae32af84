#include "calib/ring_finder.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/raster.h"

namespace veneer::calib {
namespace {

constexpr int kDirections = 72;
constexpr double kLineReach = 0.9;  // mm to both sides of the line
constexpr double kStep = 0.05;      // mm along a radius
constexpr int kSamples = static_cast<int>(2 * kLineReach / kStep) + 1;
constexpr double kRingPxPerMm = 4;                                // enough to see a 0.2 mm line, few enough to be quick
constexpr std::size_t kProposals = 500, kProposalsPerCircle = 4;  // grain, kerf lines and soot are proposed, too

// Bilinear, pixel centres at +0.5; outside the picture the border repeats.
double sample(const cv::Mat& grey, const Point<CameraFrame>& p) {
  const double x = p.x.count() - 0.5, y = p.y.count() - 0.5;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const double fx = x - x0, fy = y - y0;
  const auto at = [&](int c, int r) {
    return static_cast<double>(grey.at<std::uint8_t>(std::clamp(r, 0, grey.rows - 1), std::clamp(c, 0, grey.cols - 1)));
  };
  return (1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x0 + 1, y0)) +
         fy * ((1 - fx) * at(x0, y0 + 1) + fx * at(x0 + 1, y0 + 1));
}

// Positive on the ring, negative beside it, zero in sum, so that even ground and slopes say nothing.
cv::Mat ring_kernel(double radius_px) {
  const int half = static_cast<int>(std::ceil(radius_px + 4));
  cv::Mat kernel(2 * half + 1, 2 * half + 1, CV_32FC1);
  double ring = 0, beside = 0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int r = -half; r <= half; ++r) {
      for (int c = -half; c <= half; ++c) {
        const double off = std::hypot(r, c) - radius_px;
        const double on = std::exp(-off * off / (2 * 0.8 * 0.8));
        const double by = std::exp(-std::pow(std::abs(off) - 3, 2) / 2);
        if (pass == 0) {
          ring += on, beside += by;
        } else {
          kernel.at<float>(r + half, c + half) = static_cast<float>(on / ring - by / beside);
        }
      }
    }
  }
  return kernel;
}

// The line's place along one radius, mm from the expected; false when there is no clear dip.
bool line_on_radius(const std::array<double, kSamples>& grey, double& offset) {
  // The ground on both sides, joined by a straight line.
  constexpr int kGround = 6;
  double left = 0, right = 0;
  for (std::size_t i = 0; i < kGround; ++i) left += grey[i], right += grey[kSamples - 1 - i];
  left /= kGround, right /= kGround;
  std::array<double, kSamples> dark{};
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double t = static_cast<double>(i) / (kSamples - 1);
    dark[i] = left + (right - left) * t - grey[i];
    if (dark[i] > dark[deepest]) deepest = i;
  }
  const double ground = 0.5 * (left + right);
  if (dark[deepest] < std::max(5.0, 0.06 * ground)) return false;
  constexpr int kWindow = 9;  // +-0.45 mm around the deepest place, then once more around its centroid
  double centre = static_cast<double>(deepest);
  for (int round = 0; round < 3; ++round) {
    double weight = 0, moment = 0;
    for (int k = 0; k < kSamples; ++k) {
      // A window with a soft rim, so that the centroid moves smoothly with the line.
      const double inside = std::clamp(kWindow + 0.5 - std::abs(k - centre), 0.0, 1.0);
      const double w = inside * std::max(0.0, dark[static_cast<std::size_t>(k)]);
      weight += w, moment += w * k;
    }
    if (weight <= 0) return false;
    centre = moment / weight;
  }
  if (centre < kGround || centre > kSamples - 1 - kGround) return false;
  offset = centre * kStep - kLineReach;
  return true;
}

struct Rim {
  std::vector<double> angle, radius;
};

Rim trace_rim(const cv::Mat& grey, const CameraModel& model, Millimetres height, Point<BedFrame> centre,
              double radius) {
  Rim rim;
  for (int d = 0; d < kDirections; ++d) {
    const double angle = 2 * kPi * d / kDirections, c = std::cos(angle), s = std::sin(angle);
    std::array<double, kSamples> along{};
    for (int i = 0; i < kSamples; ++i) {
      const double r = radius - kLineReach + i * kStep;
      const auto place = point<BedFrame>(centre.x.count() + r * c, centre.y.count() + r * s);
      along[static_cast<std::size_t>(i)] = sample(grey, model.camera_from_bed(place, height));
    }
    double offset = 0;
    if (line_on_radius(along, offset)) rim.angle.push_back(angle), rim.radius.push_back(radius + offset);
  }
  return rim;
}

// radius(angle) = r + dx cos + dy sin, twice, the second time without the directions that lie off.
struct RimFit {
  double radius = 0, dx = 0, dy = 0, scatter = 0;
  std::size_t used = 0;
};

RimFit fit_rim(const Rim& rim) {
  RimFit fit;
  double limit = 1e9;
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d side = Eigen::Vector3d::Zero();
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < rim.angle.size(); ++i) {
      const Eigen::Vector3d row(1, std::cos(rim.angle[i]), std::sin(rim.angle[i]));
      const double miss = rim.radius[i] - row.dot(Eigen::Vector3d(fit.radius, fit.dx, fit.dy));
      if (round > 0 && std::abs(miss) > limit) continue;
      normal += row * row.transpose(), side += row * rim.radius[i];
      used.push_back(i);
    }
    if (used.size() < kDirections / 3) return {};
    const Eigen::Vector3d solved = normal.ldlt().solve(side);
    fit = {solved[0], solved[1], solved[2], 0, used.size()};
    double sum = 0;
    for (const std::size_t i : used) {
      const double said = solved[0] + solved[1] * std::cos(rim.angle[i]) + solved[2] * std::sin(rim.angle[i]);
      sum += std::pow(rim.radius[i] - said, 2);
    }
    fit.scatter = std::sqrt(sum / static_cast<double>(used.size()));
    limit = std::max(2.5 * fit.scatter, 0.03);
  }
  return fit;
}

}  // namespace

std::vector<Point<BedFrame>> propose_circles(const cv::Mat& grey, const CameraModel& model, Millimetres height,
                                             const Box<BedFrame>& area, Millimetres diameter, std::size_t expected) {
  const Raster<BedFrame> view{model.rectify(grey, area, {kRingPxPerMm}, height), {kRingPxPerMm}, area.min};
  // Thin dark lines only: what a closing fills up.
  cv::Mat closed, thin, dark, score;
  cv::GaussianBlur(view.pixels, thin, {}, 0.7);
  cv::morphologyEx(thin, closed, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {7, 7}));
  cv::subtract(closed, thin, dark);
  dark.convertTo(dark, CV_32FC1);
  cv::min(dark, 60.0, dark);  // one black speck must not look like a whole ring
  const double radius_px = diameter.count() / 2 * kRingPxPerMm;
  cv::filter2D(dark, score, CV_32FC1, ring_kernel(radius_px));

  cv::Mat peaks;
  const int reach = std::max(3, static_cast<int>(radius_px * 0.6));
  cv::dilate(score, peaks, cv::getStructuringElement(cv::MORPH_RECT, {2 * reach + 1, 2 * reach + 1}));
  std::vector<std::pair<float, Point<BedFrame>>> found;
  for (int r = 0; r < score.rows; ++r) {
    const auto* line = score.ptr<float>(r);
    const auto* top = peaks.ptr<float>(r);
    for (int c = 0; c < score.cols; ++c) {
      if (line[c] >= top[c] && line[c] > 2.0F) found.emplace_back(line[c], view.from_pixels(c + 0.5, r + 0.5));
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const std::size_t most = std::max(kProposals, kProposalsPerCircle * expected);
  if (found.size() > most) found.resize(most);
  std::vector<Point<BedFrame>> places;
  places.reserve(found.size());
  for (const auto& [strength, place] : found) places.push_back(place);
  return places;
}

Circle refine_circle(const cv::Mat& grey, const CameraModel& model, Millimetres height, Point<BedFrame> guess,
                     Millimetres diameter) {
  Circle circle{guess, diameter, {}, 0};
  for (int round = 0; round < 4; ++round) {
    const Rim rim = trace_rim(grey, model, height, circle.centre, circle.diameter.count() / 2);
    const RimFit fit = fit_rim(rim);
    if (fit.used == 0 || std::abs(2 * fit.radius - diameter.count()) > 0.2 * diameter.count()) {
      circle.seen = 0;
      return circle;
    }
    circle.centre = {circle.centre.x + Millimetres(fit.dx), circle.centre.y + Millimetres(fit.dy)};
    circle.diameter = Millimetres(2 * fit.radius);
    circle.scatter = Millimetres(fit.scatter);
    circle.seen = static_cast<double>(fit.used) / kDirections;
    if (std::hypot(fit.dx, fit.dy) < 1e-4) break;
  }
  return circle;
}

}  // namespace veneer::calib
