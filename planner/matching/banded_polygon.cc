#include "planner/matching/banded_polygon.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

constexpr double kLevel = 1e-12;  // a side that rises less runs along the band

// What the sides within the band span.
template <class Take>
void for_sides(const BandedPolygon::Corners& ring, double top, double bottom, Take take) {
  const std::vector<double>&x = ring.x, &y = ring.y;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t j = (i + 1) % x.size();
    const double from = std::max(std::min(y[i], y[j]), top), to = std::min(std::max(y[i], y[j]), bottom);
    if (from > to) continue;
    const double run = y[j] - y[i];
    const bool level = std::abs(run) < kLevel;
    const double a = level ? x[i] : x[i] + (x[j] - x[i]) * ((from - y[i]) / run);
    const double b = level ? x[j] : x[i] + (x[j] - x[i]) * ((to - y[i]) / run);
    take(std::min(a, b), std::max(a, b));
  }
}

}  // namespace

bool is_convex(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr double kStraight = 1e-9;  // the sine of a turn that counts as none
  const std::size_t n = x.size();
  bool left = false, right = false;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = (i + 1) % n, k = (i + 2) % n;
    const double ax = x[j] - x[i], ay = y[j] - y[i], bx = x[k] - x[j], by = y[k] - y[j];
    const double turn = ax * by - ay * bx, slack = kStraight * std::sqrt((ax * ax + ay * ay) * (bx * bx + by * by));
    left = left || turn > slack, right = right || turn < -slack;
  }
  return !(left && right);
}

BandedPolygon::BandedPolygon(std::vector<Corners> rings)
    : rings_(std::move(rings)), convex_(rings_.size() == 1 && is_convex(rings_.front().x, rings_.front().y)) {
  for (const Corners& ring : rings_) {
    for (const double x : ring.x) left_ = std::min(left_, x), right_ = std::max(right_, x);
    for (const double y : ring.y) top_ = std::min(top_, y), bottom_ = std::max(bottom_, y);
  }
}

const std::vector<BandedPolygon::Interval>& BandedPolygon::within(double top, double bottom) const {
  found_.clear();
  if (convex_) {
    Interval all{1e300, -1e300};
    for_sides(rings_.front(), top, bottom,
              [&](double low, double high) { all.low = std::min(all.low, low), all.high = std::max(all.high, high); });
    if (all.low <= all.high) found_.push_back(all);
    return found_;
  }
  crossings_.clear();
  const double middle = (top + bottom) / 2;
  for (const Corners& ring : rings_) {
    for_sides(ring, top, bottom, [&](double low, double high) { found_.push_back({low, high}); });
    for (std::size_t i = 0; i < ring.x.size(); ++i) {
      const std::size_t j = (i + 1) % ring.x.size();
      if ((ring.y[i] <= middle) == (ring.y[j] <= middle)) continue;
      crossings_.push_back(ring.x[i] + (ring.x[j] - ring.x[i]) * ((middle - ring.y[i]) / (ring.y[j] - ring.y[i])));
    }
  }
  std::sort(crossings_.begin(), crossings_.end());
  for (std::size_t i = 0; i + 1 < crossings_.size(); i += 2) found_.push_back({crossings_[i], crossings_[i + 1]});
  return found_;
}

}  // namespace veneer::planner
