#include "calib/hole_detector.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr int kRays = 120;
constexpr double kSearchPxPerMm = 4;  // resolution at which bright spots are looked for

// Bright round spots of about the wanted size, in full-resolution pixels.
std::vector<Eigen::Vector2d> bright_spots(const cv::Mat& small, double scale, double diameter_px, double white) {
  std::vector<Eigen::Vector2d> spots;
  for (const double share : {0.62, 0.72, 0.80, 0.88}) {
    const cv::Mat mask = small >= share * white;
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(mask, labels, stats, centres, 4);
    for (int i = 1; i < count; ++i) {
      const int w = stats.at<int>(i, cv::CC_STAT_WIDTH), h = stats.at<int>(i, cv::CC_STAT_HEIGHT);
      const double fill = stats.at<int>(i, cv::CC_STAT_AREA) / static_cast<double>(w * h);
      if (std::max(w, h) > 1.3 * diameter_px || std::min(w, h) < 0.5 * diameter_px) continue;
      if (std::max(w, h) > 1.35 * std::min(w, h) || fill < 0.62 || fill > 0.92) continue;
      const Eigen::Vector2d at((centres.at<double>(i, 0) + 0.5) * scale, (centres.at<double>(i, 1) + 0.5) * scale);
      const bool known = std::any_of(spots.begin(), spots.end(), [&](const Eigen::Vector2d& s) {
        return (s - at).norm() < 0.5 * diameter_px * scale;
      });
      if (!known) spots.push_back(at);
    }
  }
  return spots;
}

// Grey levels around a centre: one row per ray, one column per half pixel of radius.
struct Radial {
  double from = 0, step = 0.5;
  Eigen::MatrixXd levels;
  Eigen::VectorXd mean() const {
    // The median over the rays, so that a neighbour on one side does not count.
    Eigen::VectorXd out(levels.cols());
    std::vector<double> column(kRays);
    for (Eigen::Index k = 0; k < levels.cols(); ++k) {
      for (int ray = 0; ray < kRays; ++ray) column[static_cast<std::size_t>(ray)] = levels(ray, k);
      std::nth_element(column.begin(), column.begin() + kRays / 2, column.end());
      out(k) = column[kRays / 2];
    }
    return out;
  }
};

Eigen::Vector2d ray_direction(int ray) {
  const double angle = 2 * kPi * ray / kRays;
  return {std::cos(angle), std::sin(angle)};
}

Radial look_around(const cv::Mat& grey, const Eigen::Vector2d& centre, double from, double to) {
  Radial around;
  around.from = from;
  const auto count = static_cast<Eigen::Index>((to - from) / around.step) + 1;
  around.levels.resize(kRays, count);
  for (int ray = 0; ray < kRays; ++ray)
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::Vector2d at = centre + ray_direction(ray) * (from + around.step * static_cast<double>(k));
      around.levels(ray, k) = level_at(grey, at.x(), at.y());
    }
  return around;
}

// Where the mean profile changes most between the two radii; 0 when it hardly changes.
double rim_radius(const cv::Mat& grey, const Eigen::Vector2d& centre, double from, double to) {
  const Radial around = look_around(grey, centre, from - 2, to + 2);
  const Eigen::VectorXd mean = around.mean();
  double best = 3, radius = 0;  // grey levels per pixel that are worth calling a rim
  for (Eigen::Index k = 3; k + 3 < mean.size(); ++k) {
    const double slope = std::abs(mean(k + 2) - mean(k - 2)) / (4 * around.step);
    if (slope <= best) continue;
    best = slope, radius = around.from + around.step * static_cast<double>(k);
  }
  return radius;
}

struct RimFit {
  Eigen::VectorXd stray;  // per ray, px; how far its rim lies from the mean rim
  double rms = 0, seen = 0;
};

// Moves the centre until every ray's profile lies on the mean profile (Lucas-Kanade on a round template), whatever
// that profile is: a plain edge, or a shadow before the bright lid.
RimFit settle(const cv::Mat& grey, Eigen::Vector2d& centre, double radius, double px_per_mm) {
  RimFit fit;
  const double limit = std::max(1.0, 0.15 * px_per_mm);
  for (int pass = 0; pass < 12; ++pass) {
    const Radial around = look_around(grey, centre, radius - 0.5 * px_per_mm, radius + 0.3 * px_per_mm);
    const Eigen::VectorXd mean = around.mean();
    const Eigen::Index n = mean.size();
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 1; k + 1 < n; ++k) slope(k) = (mean(k + 1) - mean(k - 1)) / (2 * around.step);
    const double power = slope.squaredNorm();
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    fit.stray.resize(kRays);
    for (int ray = 0; ray < kRays; ++ray) {
      fit.stray(ray) = -slope.dot(around.levels.row(ray).transpose() - mean) / std::max(power, 1e-9);
      // Dust on the rim must not pull: rays count less the farther they stray (Tukey's weights).
      const double off = fit.stray(ray) / (pass < 3 ? 3 * limit : limit);
      if (std::abs(off) > 1) continue;
      const double weight = (1 - off * off) * (1 - off * off);
      const Eigen::Vector2d d = ray_direction(ray);
      normal += weight * d * d.transpose();
      right += weight * d * fit.stray(ray);
    }
    if (std::abs(normal.determinant()) < 1) break;
    const Eigen::Vector2d move = normal.ldlt().solve(right);
    centre += move;
    if (move.norm() < 1e-3) break;
  }
  for (int ray = 0; ray < kRays; ++ray) {
    if (std::abs(fit.stray(ray)) > limit) continue;
    fit.seen += 1, fit.rms += fit.stray(ray) * fit.stray(ray);
  }
  fit.rms = fit.seen > 0 ? std::sqrt(fit.rms / fit.seen) : limit;
  fit.seen /= kRays;
  return fit;
}

// Whether the lid is seen inside: bright, and without colour.
bool shows_lid(const cv::Mat& picture, const cv::Point& middle, double radius, double white) {
  const int half = static_cast<int>(radius * 0.35);
  const cv::Rect box = cv::Rect(middle.x - half, middle.y - half, 2 * half + 1, 2 * half + 1) &
                       cv::Rect(0, 0, picture.cols, picture.rows);
  if (box.empty()) return false;
  const cv::Scalar mean = cv::mean(picture(box));
  const double low = picture.channels() == 1 ? mean[0] : std::min({mean[0], mean[1], mean[2]});
  const double high = picture.channels() == 1 ? mean[0] : std::max({mean[0], mean[1], mean[2]});
  return low > 0.8 * white && low > 0.9 * high;
}

}  // namespace

std::vector<Hole> detect_holes(const cv::Mat& picture, ScanResolution resolution, const HoleOptions& options) {
  if (picture.empty() || (picture.type() != CV_8UC1 && picture.type() != CV_8UC3)) return {};
  const double px_per_mm = resolution.px_per_mm, radius = resolution.to_px(options.diameter).count() / 2;
  const double shrink = std::min(1.0, kSearchPxPerMm / px_per_mm);
  cv::Mat small;
  cv::resize(picture, small, {}, shrink, shrink, cv::INTER_AREA);
  small = darkest_channel(small);
  const double white = top_level(small, 0.002);
  const double scale = static_cast<double>(picture.cols) / small.cols;

  std::vector<Hole> holes;
  for (Eigen::Vector2d centre : bright_spots(small, scale, 2 * radius / scale, white)) {
    // A piece of the picture that holds the hole and its surroundings.
    const int reach = static_cast<int>(radius * 1.7) + 4;
    const cv::Rect box =
        cv::Rect(static_cast<int>(centre.x()) - reach, static_cast<int>(centre.y()) - reach, 2 * reach, 2 * reach) &
        cv::Rect(0, 0, picture.cols, picture.rows);
    if (box.width < 2 * radius || box.height < 2 * radius) continue;
    if (!shows_lid(picture, {static_cast<int>(centre.x()), static_cast<int>(centre.y())}, radius, white)) continue;
    const cv::Mat grey = darkest_channel(picture(box));
    const Eigen::Vector2d shift(box.x, box.y);
    Eigen::Vector2d local = centre - shift;
    const double tolerance = options.diameter_tolerance;
    double rim = 0;
    RimFit fit;
    // The rim is looked for again once the centre is better.
    for (int pass = 0; pass < 2; ++pass) {
      rim = rim_radius(grey, local, radius * (1 - tolerance), radius * (1 + tolerance));
      if (rim == 0) break;
      fit = settle(grey, local, rim, px_per_mm);
    }
    if (rim == 0 || (local + shift - centre).norm() > radius) continue;
    if (fit.seen < options.min_rim_seen || fit.rms > resolution.to_px(options.max_rim_rms).count()) continue;
    centre = local + shift;
    if (centre.x() < rim || centre.y() < rim || centre.x() > picture.cols - rim || centre.y() > picture.rows - rim)
      continue;
    holes.push_back({point<ScanFrame>(centre.x(), centre.y()), Pixels(2 * rim), Pixels(fit.rms), fit.seen});
  }
  std::sort(holes.begin(), holes.end(), [](const Hole& a, const Hole& b) { return a.centre.x < b.centre.x; });
  return holes;
}

}  // namespace veneer::calib
