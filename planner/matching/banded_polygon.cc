#include "planner/matching/banded_polygon.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

constexpr double kLevel = 1e-12;  // a side that rises less runs along the band

// What a side spans within the band.
template <class Take>
void take_side(double x0, double y0, double x1, double y1, double top, double bottom, Take take) {
  const double from = std::max(std::min(y0, y1), top), to = std::min(std::max(y0, y1), bottom);
  if (from > to) return;
  const double run = y1 - y0;
  const bool level = std::abs(run) < kLevel;
  const double a = level ? x0 : x0 + (x1 - x0) * ((from - y0) / run);
  const double b = level ? x1 : x0 + (x1 - x0) * ((to - y0) / run);
  take(std::min(a, b), std::max(a, b));
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
  if (!convex_ && top_ <= bottom_) sort_sides();
}

void BandedPolygon::sort_sides() {
  first_row_ = std::floor(top_), rows_ = static_cast<int>(std::floor(bottom_) - first_row_) + 1;
  begins_.assign(static_cast<std::size_t>(rows_) + 1, 0);
  const auto for_rows = [&](auto visit) {
    for (const Corners& ring : rings_)
      for (std::size_t i = 0; i < ring.x.size(); ++i) {
        const std::size_t j = (i + 1) % ring.x.size();
        const int first = row_of(std::min(ring.y[i], ring.y[j])), last = row_of(std::max(ring.y[i], ring.y[j]));
        for (int r = first; r <= std::min(last, rows_ - 1); ++r)
          visit(static_cast<std::size_t>(r), Side{ring.x[i], ring.y[i], ring.x[j], ring.y[j], first});
      }
  };
  for_rows([&](std::size_t r, const Side&) { ++begins_[r + 1]; });
  for (std::size_t r = 1; r < begins_.size(); ++r) begins_[r] += begins_[r - 1];
  sides_.resize(begins_.back());
  std::vector<std::size_t> next(begins_.begin(), begins_.end() - 1);
  for_rows([&](std::size_t r, const Side& side) { sides_[next[r]++] = side; });
}

const std::vector<BandedPolygon::Interval>& BandedPolygon::within(double top, double bottom) const {
  found_.clear();
  if (convex_) {
    Interval all{1e300, -1e300};
    const std::vector<double>&x = rings_.front().x, &y = rings_.front().y;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t j = (i + 1) % x.size();
      take_side(x[i], y[i], x[j], y[j], top, bottom, [&](double low, double high) {
        all.low = std::min(all.low, low), all.high = std::max(all.high, high);
      });
    }
    if (all.low <= all.high) found_.push_back(all);
    return found_;
  }
  const auto for_row = [&](int row, auto visit) {
    if (row < 0 || row >= rows_) return;
    const auto r = static_cast<std::size_t>(row);
    for (std::size_t i = begins_[r]; i < begins_[r + 1]; ++i) visit(sides_[i]);
  };
  const int first = std::max(row_of(top), 0), last = std::min(row_of(bottom), rows_ - 1);
  for (int row = first; row <= last; ++row)
    for_row(row, [&](const Side& it) {
      if (row > first && it.first_row < row) return;  // it was there in the row above
      take_side(it.x0, it.y0, it.x1, it.y1, top, bottom, [&](double low, double high) {
        found_.push_back({low, high});
      });
    });
  crossings_.clear();
  const double middle = (top + bottom) / 2;
  for_row(row_of(middle), [&](const Side& it) {
    if ((it.y0 <= middle) == (it.y1 <= middle)) return;
    crossings_.push_back(it.x0 + (it.x1 - it.x0) * ((middle - it.y0) / (it.y1 - it.y0)));
  });
  std::sort(crossings_.begin(), crossings_.end());
  for (std::size_t i = 0; i + 1 < crossings_.size(); i += 2) found_.push_back({crossings_[i], crossings_[i + 1]});
  return found_;
}

}  // namespace veneer::planner
