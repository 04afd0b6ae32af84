#include "planner/cut_order.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace veneer::planner {
namespace {

using Order = std::vector<std::size_t>;

class Tour {
 public:
  Tour(const std::vector<CutSite>& sites, Point<BedFrame> start) : sites_(sites), start_(start) {}

  Order nearest_neighbours() const {
    std::vector<bool> visited(sites_.size(), false);
    Order order;
    order.reserve(sites_.size());
    Point<BedFrame> at = start_;
    while (order.size() < sites_.size()) {
      std::size_t nearest = sites_.size();
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < sites_.size(); ++i) {
        const double d = visited[i] ? least : distance(at, sites_[i].place).count();
        if (d < least) least = d, nearest = i;
      }
      visited[nearest] = true;
      order.push_back(nearest);
      at = sites_[nearest].place;
    }
    return order;
  }

  // Reverses stretches while that shortens the tour.
  bool two_opt(Order& order) const {
    bool improved = false;
    const std::size_t n = order.size();
    for (std::size_t i = 0; i + 1 < n; ++i) {
      for (std::size_t k = i + 1; k < n; ++k) {
        const double before = leg(order, i) + leg(order, k + 1);
        const double after =
            between(entry(order, i), site(order, k)) + (k + 1 < n ? between(site(order, i), site(order, k + 1)) : 0);
        if (after >= before - kGain) continue;
        std::reverse(order.begin() + static_cast<std::ptrdiff_t>(i),
                     order.begin() + static_cast<std::ptrdiff_t>(k) + 1);
        improved = true;
      }
    }
    return improved;
  }

  // Moves stretches of up to three sites to where they cost least.
  bool or_opt(Order& order) const {
    bool improved = false;
    for (std::size_t length = 1; length <= 3 && length < order.size(); ++length)
      for (std::size_t from = 0; from + length <= order.size(); ++from) improved |= move_stretch(order, from, length);
    return improved;
  }

 private:
  static constexpr double kGain = 1e-9;  // below it a change is rounding, and could go on for ever

  static double between(const Point<BedFrame>& a, const Point<BedFrame>& b) { return distance(a, b).count(); }
  const Point<BedFrame>& site(const Order& order, std::size_t i) const { return sites_[order[i]].place; }
  const Point<BedFrame>& entry(const Order& order, std::size_t i) const { return i == 0 ? start_ : site(order, i - 1); }
  // The way to the i-th site; nothing behind the last.
  double leg(const Order& order, std::size_t i) const {
    return i < order.size() ? between(entry(order, i), site(order, i)) : 0;
  }

  bool move_stretch(Order& order, std::size_t from, std::size_t length) const {
    const std::size_t n = order.size(), end = from + length;
    const Point<BedFrame> first = site(order, from), last = site(order, end - 1);
    const double joined = end < n ? between(entry(order, from), site(order, end)) : 0;
    const double saved = leg(order, from) + leg(order, end) - joined;
    double best = kGain;
    std::size_t best_to = n + 1;
    bool best_reversed = false;
    for (std::size_t to = 0; to <= n; ++to) {
      if (to >= from && to <= end) continue;
      const Point<BedFrame>& before = entry(order, to);
      const double after = to < n ? between(last, site(order, to)) : 0;
      const double after_reversed = to < n ? between(first, site(order, to)) : 0;
      const double straight = between(before, first) + after - leg(order, to);
      const double reversed = between(before, last) + after_reversed - leg(order, to);
      if (saved - std::min(straight, reversed) <= best) continue;
      best = saved - std::min(straight, reversed);
      best_to = to;
      best_reversed = reversed < straight;
    }
    if (best_to > n) return false;
    Order stretch(order.begin() + static_cast<std::ptrdiff_t>(from), order.begin() + static_cast<std::ptrdiff_t>(end));
    if (best_reversed) std::reverse(stretch.begin(), stretch.end());
    order.erase(order.begin() + static_cast<std::ptrdiff_t>(from), order.begin() + static_cast<std::ptrdiff_t>(end));
    const std::size_t to = best_to > from ? best_to - length : best_to;
    order.insert(order.begin() + static_cast<std::ptrdiff_t>(to), stretch.begin(), stretch.end());
    return true;
  }

  const std::vector<CutSite>& sites_;
  Point<BedFrame> start_;
};

// Keeps the order, but pulls what must come before a site in front of it. Depth first; a cycle is cut where it closes.
class Precedence {
 public:
  explicit Precedence(const std::vector<CutSite>& sites) : sites_(sites), state_(sites.size(), State::kNew) {}

  Order apply(const Order& order) {
    Order out;
    out.reserve(order.size());
    for (const std::size_t i : order) visit(i, out);
    return out;
  }

 private:
  enum class State { kNew, kOpen, kDone };

  void visit(std::size_t i, Order& out) {
    if (i >= sites_.size() || state_[i] != State::kNew) return;
    state_[i] = State::kOpen;
    for (const std::size_t before : sites_[i].after) visit(before, out);
    state_[i] = State::kDone;
    out.push_back(i);
  }

  const std::vector<CutSite>& sites_;
  std::vector<State> state_;
};

}  // namespace

std::vector<std::size_t> cut_order(const std::vector<CutSite>& sites, Point<BedFrame> start) {
  const Tour tour(sites, start);
  Order order = tour.nearest_neighbours();
  // Each round costs n^2; tours of thousands of pieces are good long before nothing improves any more.
  constexpr int kMostRounds = 40;
  for (int round = 0; round < kMostRounds; ++round) {
    const bool shorter = tour.two_opt(order);
    if (!tour.or_opt(order) && !shorter) break;
  }
  return Precedence(sites).apply(order);
}

Millimetres tour_length(const std::vector<CutSite>& sites, const std::vector<std::size_t>& order,
                        Point<BedFrame> start) {
  Millimetres sum{0};
  Point<BedFrame> at = start;
  for (const std::size_t i : order) {
    sum += distance(at, sites[i].place);
    at = sites[i].place;
  }
  return sum;
}

}  // namespace veneer::planner
