#include "planner/cutting/time_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace veneer::planner {
namespace {

struct Vector {
  double x = 0, y = 0;
};

// One straight move of the controller.
struct Move {
  Vector unit;
  double length = 0;
  double acceleration = 0, speed = 0;  // along its direction
  double entry_sqr = 0;                // highest speed squared at which the corner into it can be taken
  double alone_s = 0;                  // from rest to rest
};

double alone_s(double length, double speed, double acceleration) {
  const double ramps = speed * speed / acceleration;
  return length >= ramps ? length / speed + speed / acceleration : 2 * std::sqrt(length / acceleration);
}

// The longest way that takes no longer from rest to rest.
double reach(double seconds, double speed, double acceleration) {
  const double ramps = 2 * speed / acceleration;
  return seconds >= ramps ? speed * (seconds - ramps / 2) : acceleration * seconds * seconds / 4;
}

class Route {
 public:
  Route(Point<BedFrame> from, const Kinematics& kinematics)
      : kinematics_(kinematics), at_{from.x.count(), from.y.count()} {}

  void travel(const Point<BedFrame>& to) { add({to.x.count(), to.y.count()}, std::numeric_limits<double>::infinity()); }

  void burn(const Polyline<BedFrame>& path, double speed) {
    for (std::size_t i = 1; i < path.size(); ++i) add({path[i].x.count(), path[i].y.count()}, speed);
  }

  double seconds() const {
    double total = 0, entry_sqr = 0;
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      const Move& m = moves_[i];
      const double exit_sqr = std::min(exit_allowed(i), entry_sqr + 2 * m.acceleration * m.length);
      total += move_s(m, entry_sqr, exit_sqr);
      entry_sqr = exit_sqr;
    }
    return total;
  }

 private:
  // The axis that is slower in this direction decides.
  static double along(Vector unit, double x, double y) {
    const double infinity = std::numeric_limits<double>::infinity();
    return std::min(std::abs(unit.x) > 1e-12 ? x / std::abs(unit.x) : infinity,
                    std::abs(unit.y) > 1e-12 ? y / std::abs(unit.y) : infinity);
  }
  double acceleration_along(Vector unit) const {
    return along(unit, kinematics_.acceleration_x.count(), kinematics_.acceleration_y.count());
  }

  double corner_sqr(Vector in, Vector out) const {
    const double cosine = in.x * out.x + in.y * out.y;  // 1: straight on
    if (cosine > 0.999999) return std::numeric_limits<double>::infinity();
    if (cosine < -0.999999) return 0;
    const Vector change{out.x - in.x, out.y - in.y};
    const double norm = std::hypot(change.x, change.y);
    const double s = std::sqrt((1 + cosine) / 2);  // sine of half the angle enclosed
    return acceleration_along({change.x / norm, change.y / norm}) * kinematics_.junction_deviation.count() * s /
           (1 - s);
  }

  // The driver splits what takes longer than its longest move.
  void add(Vector to, double speed) {
    const Vector way{to.x - at_.x, to.y - at_.y};
    const double length = std::hypot(way.x, way.y);
    if (length < 5e-4) return;
    Move move;
    move.unit = {way.x / length, way.y / length};
    move.acceleration = acceleration_along(move.unit);
    move.speed = std::min(speed, along(move.unit, kinematics_.rapid_x.count(), kinematics_.rapid_y.count()));
    const double longest = reach(kinematics_.longest_move.count(), move.speed, move.acceleration);
    const int parts = static_cast<int>(std::ceil(length / longest));
    move.length = length / parts;
    move.alone_s = alone_s(move.length, move.speed, move.acceleration);
    for (int i = 0; i < parts; ++i) {
      move.entry_sqr = moves_.empty() ? 0 : corner_sqr(moves_.back().unit, move.unit);
      if (!moves_.empty())
        move.entry_sqr = std::min({move.entry_sqr, move.speed * move.speed, moves_.back().speed * moves_.back().speed});
      moves_.push_back(move);
    }
    at_ = to;
  }

  // How fast the i-th move may end, as far as the controller can see then: it must be able to stop where the queue
  // ends.
  double exit_allowed(std::size_t i) const {
    std::size_t last = i;
    double queued = moves_[i].alone_s;
    while (last + 1 < moves_.size() && static_cast<int>(last + 1 - i) < kinematics_.planner_moves &&
           queued + moves_[last + 1].alone_s <= kinematics_.queued.count())
      queued += moves_[++last].alone_s;
    double exit_sqr = 0;
    for (std::size_t k = last; k > i; --k)
      exit_sqr = std::min(moves_[k].entry_sqr, exit_sqr + 2 * moves_[k].acceleration * moves_[k].length);
    return exit_sqr;
  }

  static double move_s(const Move& m, double entry_sqr, double exit_sqr) {
    const double a = m.acceleration, entry = std::sqrt(entry_sqr), exit = std::sqrt(exit_sqr);
    const double peak_sqr = std::min(m.speed * m.speed, a * m.length + (entry_sqr + exit_sqr) / 2);
    const double peak = std::sqrt(std::max({peak_sqr, entry_sqr, exit_sqr}));
    const double ramps = (2 * peak * peak - entry_sqr - exit_sqr) / (2 * a);
    return (2 * peak - entry - exit) / a + std::max(0.0, m.length - ramps) / peak;
  }

  const Kinematics& kinematics_;
  Vector at_;
  std::vector<Move> moves_;
};

}  // namespace

std::chrono::duration<double> estimate_piece(std::span<const StrokeIn<BedFrame>> strokes, Point<BedFrame> from,
                                             const Kinematics& kinematics) {
  Route route(from, kinematics);
  for (const StrokeIn<BedFrame>& stroke : strokes) {
    if (stroke.path.size() < 2 || stroke.speed.count() <= 0) continue;
    route.travel(stroke.path.front());
    Polyline<BedFrame> path = stroke.path;
    const bool closed = distance(path.front(), path.back()).count() < 5e-4;
    for (int pass = 0; pass < stroke.passes; ++pass) {
      route.burn(path, stroke.speed.count());
      if (!closed) std::reverse(path.begin(), path.end());
    }
  }
  return std::chrono::duration<double>(route.seconds()) + kinematics.drain;
}

}  // namespace veneer::planner
