#include "calib/tag_border.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

using Vec = Eigen::Vector2d;

// A line as a point on it and its direction.
struct EdgeLine {
  Vec at, along;
  double off(const Vec& p) const { return std::abs(along.x() * (p - at).y() - along.y() * (p - at).x()); }
};

// Grey levels across a side at one place along it, from inside (black) to outside (white), `step` px apart and the
// place in their middle.
struct SideProfile {
  Vec middle;
  std::vector<double> levels;
  double black() const { return (levels[0] + levels[1]) / 2; }
  double white() const { return (levels[levels.size() - 1] + levels[levels.size() - 2]) / 2; }
};

struct BorderSide {
  Vec outwards;
  int half = 0;  // steps to either end of a profile
  double step = 0;
  std::vector<SideProfile> profiles;
};

// Corners run counter-clockwise on the screen, where y is down: outwards is to the left of i + 1 -> i.
BorderSide look_across(const cv::Mat& grey, const Vec& from, const Vec& to, double reach, double step) {
  const Vec along = (to - from).normalized();
  BorderSide side{Vec(-along.y(), along.x()), static_cast<int>(reach / step), step, {}};
  const double length = (to - from).norm();
  const int places = std::clamp(static_cast<int>(length), 8, 200);
  for (int i = 0; i < places; ++i) {
    SideProfile& profile = side.profiles.emplace_back();
    profile.middle = from + along * (length * (0.06 + 0.88 * (i + 0.5) / places));
    for (int k = -side.half; k <= side.half; ++k) {
      const Vec at = profile.middle + side.outwards * (k * step);
      profile.levels.push_back(level_at(grey, at.x(), at.y()));
    }
  }
  return side;
}

struct BorderLevels {
  double black = 0, white = 0;
  double contrast() const { return white - black; }
};
constexpr double kLeastContrast = 15;  // grey levels

BorderLevels usual_levels(const BorderSide& side) {
  std::vector<double> black, white;
  for (const SideProfile& profile : side.profiles) black.push_back(profile.black()), white.push_back(profile.white());
  return {median(std::move(black)), median(std::move(white))};
}

// Total least squares through the points, those farther than three times the scatter dropped.
std::optional<EdgeLine> fit_line(std::vector<Vec> points) {
  EdgeLine line;
  for (int pass = 0; pass < 3; ++pass) {
    if (points.size() < 6) return std::nullopt;
    Vec mean = Vec::Zero();
    for (const Vec& p : points) mean += p;
    mean /= static_cast<double>(points.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const Vec& p : points) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    line = {mean, axes.eigenvectors().col(1)};
    const double scatter = std::sqrt(axes.eigenvalues()(0) / static_cast<double>(points.size()));
    const double limit = 3 * std::max(scatter, 0.02);
    std::erase_if(points, [&](const Vec& p) { return line.off(p) > limit; });
  }
  return line;
}

// The points that the line through some two of them brings nearest to half of all (least median of squares), and
// nothing when fewer than `least` lie near that line.
std::vector<Vec> straight_ones(const std::vector<Vec>& points, double tolerance, std::size_t least) {
  EdgeLine best;
  double best_median = std::numeric_limits<double>::infinity();
  const std::size_t n = points.size();
  if (n < least) return {};
  // Pairs that lie far apart: a third, half and two thirds of the side. So many begin all along it that some are good.
  const std::size_t stride = std::max<std::size_t>(1, n / 24);
  for (const std::size_t apart : {n / 3, n / 2, 2 * n / 3})
    for (std::size_t i = 0; apart > 0 && i + apart < n; i += stride) {
      const Vec way = points[i + apart] - points[i];
      if (way.norm() < 1) continue;
      const EdgeLine line{points[i], way.normalized()};
      std::vector<double> off;
      off.reserve(n);
      for (const Vec& p : points) off.push_back(line.off(p));
      if (const double m = median(std::move(off)); m < best_median) best_median = m, best = line;
    }
  if (!std::isfinite(best_median)) return {};
  std::vector<Vec> near;
  const double limit = std::max(tolerance, 4.5 * best_median);  // 3 sigma of what scatters so
  for (const Vec& p : points)
    if (best.off(p) <= limit) near.push_back(p);
  return near.size() >= least ? near : std::vector<Vec>{};
}

// Where a side runs, though the corners that are known may be several pixels off: from the places where black turns
// white exactly once.
std::optional<EdgeLine> find_edge(const cv::Mat& grey, const Vec& from, const Vec& to, double cell) {
  constexpr double kAgree = 0.5;  // of all places along the side
  const BorderSide side = look_across(grey, from, to, 0.5 * cell, 0.5);
  const BorderLevels usual = usual_levels(side);
  if (usual.contrast() < kLeastContrast) return std::nullopt;
  const double middle = (usual.black + usual.white) / 2;
  std::vector<Vec> points;
  for (const SideProfile& profile : side.profiles) {
    double rise = 0;
    int turns = 0;
    for (std::size_t k = 1; k < profile.levels.size(); ++k) {
      const double before = profile.levels[k - 1], after = profile.levels[k];
      if ((before < middle) == (after < middle)) continue;
      ++turns;
      rise = static_cast<double>(k) - (after - middle) / (after - before);
    }
    if (turns != 1 || profile.black() > middle) continue;
    points.emplace_back(profile.middle + side.outwards * ((rise - side.half) * side.step));
  }
  const auto least = static_cast<std::size_t>(std::ceil(kAgree * static_cast<double>(side.profiles.size())));
  return fit_line(straight_ones(points, 0.5, least));
}

// Where black turns white across one place. The area of the rise tells the place of the step whatever the (symmetric)
// blur.
Vec step_of(const BorderSide& side, const SideProfile& profile, const BorderLevels& levels) {
  double bright = 0;  // trapezoidal area over the black level
  for (std::size_t k = 0; k < profile.levels.size(); ++k)
    bright += (k == 0 || k + 1 == profile.levels.size() ? 0.5 : 1.0) * (profile.levels[k] - levels.black);
  return profile.middle + side.outwards * (side.half * side.step - bright * side.step / levels.contrast());
}

// Where the border between black (inside) and white runs between two corners.
std::optional<EdgeLine> refine_edge(const cv::Mat& grey, const Vec& from, const Vec& to, double cell) {
  constexpr double kStain = 0.1;  // of the contrast: there black or white is not what it is elsewhere
  constexpr double kFaint = 0.4;  // of the contrast: what lies there is hardly seen through
  const BorderSide side = look_across(grey, from, to, std::clamp(0.4 * cell, 1.5, 4.0), 0.25);
  const BorderLevels usual = usual_levels(side);
  if (usual.contrast() < kLeastContrast) return std::nullopt;
  std::vector<const SideProfile*> clean;
  BorderLevels mean;
  for (const SideProfile& profile : side.profiles) {
    const double limit = kStain * usual.contrast();
    if (std::abs(profile.black() - usual.black) > limit || std::abs(profile.white() - usual.white) > limit) continue;
    clean.push_back(&profile);
    mean.black += profile.black(), mean.white += profile.white();
  }
  std::vector<Vec> points;
  if (2 * clean.size() >= side.profiles.size()) {
    mean.black /= static_cast<double>(clean.size()), mean.white /= static_cast<double>(clean.size());
    for (const SideProfile* profile : clean) points.push_back(step_of(side, *profile, mean));
  } else {
    // Half of it is stained: each place by its own black and white, though they are noisier.
    for (const SideProfile& profile : side.profiles)
      if (const BorderLevels own{profile.black(), profile.white()}; own.contrast() >= kFaint * usual.contrast())
        points.push_back(step_of(side, profile, own));
  }
  if (const auto straight = straight_ones(points, 0.06, points.size() / 2); !straight.empty())
    return fit_line(straight);
  return fit_line(std::move(points));
}

std::optional<Vec> crossing(const EdgeLine& a, const EdgeLine& b) {
  const double sine = a.along.x() * b.along.y() - a.along.y() * b.along.x();
  if (std::abs(sine) < 0.2) return std::nullopt;
  const Vec d = b.at - a.at;
  return a.at + a.along * ((d.x() * b.along.y() - d.y() * b.along.x()) / sine);
}

double cell_of(const TagCorners& c) { return ((c[1] - c[0]).norm() + (c[2] - c[1]).norm()) / 16; }

// Where `edge_of(from, to)` puts the four corners; nothing when one of them is farther than `most` from where it was
// found.
template <class EdgeOf>
std::optional<TagCorners> cross_edges(const TagCorners& now, const TagCorners& found, double most,
                                      const EdgeOf& edge_of) {
  std::array<EdgeLine, 4> edges;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto edge = edge_of(now[i], now[(i + 1) % 4]);
    if (!edge) return std::nullopt;
    edges[i] = *edge;
  }
  TagCorners out;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto corner = crossing(edges[(i + 3) % 4], edges[i]);
    if (!corner || (*corner - found[i]).norm() > most) return std::nullopt;
    out[i] = *corner;
  }
  return out;
}

double most_apart(const TagCorners& a, const TagCorners& b) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

}  // namespace

TagCorners refine_corners(const cv::Mat& grey, const TagCorners& found) {
  constexpr double kNear = 2;        // px: the detector's own corners are so near where nothing lies on them
  constexpr double kNearEnough = 1;  // px: nearer than that they need no second finding
  TagCorners start = found;
  double most = kNear;
  const double cell = cell_of(found);
  const auto seen = cross_edges(found, found, 0.5 * cell,
                                [&](const Vec& from, const Vec& to) { return find_edge(grey, from, to, cell); });
  if (seen && most_apart(*seen, found) > kNearEnough) start = *seen, most = 0.5 * cell;
  TagCorners now = start;
  for (int pass = 0; pass < 2; ++pass) {
    const auto better = cross_edges(
        now, found, most, [&](const Vec& from, const Vec& to) { return refine_edge(grey, from, to, cell_of(now)); });
    if (!better) return start;
    now = *better;
  }
  return now;
}

}  // namespace veneer::calib
