#include "drivers/lihuiyu/mil_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace veneer::lihuiyu {
namespace {

using Place = std::array<double, 2>;
using Cell = std::array<std::int64_t, 2>;

std::int64_t nearest_mil(double mils) { return static_cast<std::int64_t>(std::floor(mils + 0.5)); }

// Each mil is the middle of a square cell. A path runs from cell to cell over their sides; each crossing is a step in x
// or y. Two steps round a corner become one diagonal step when the path only clips the corner of the cell between, that
// is, when it stays in the quarter next to that corner and no more than half a mil from the diagonal. On a straight
// line this is the nearest step for every mil of the longer axis.
class Stepper {
 public:
  explicit Stepper(Place start) : at_(start), cell_{nearest_mil(start[0]), nearest_mil(start[1])} {}

  void line_to(const Place& end) {
    const Place from = at_;
    const Cell target{nearest_mil(end[0]), nearest_mil(end[1])};
    while (cell_ != target) {
      // Which side of the cell the line crosses next.
      std::array<double, 2> when{};
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::int64_t left = target[axis] - cell_[axis];
        const double side = static_cast<double>(cell_[axis]) + (left > 0 ? 0.5 : -0.5);
        when[axis] =
            left == 0 ? std::numeric_limits<double>::infinity() : (side - from[axis]) / (end[axis] - from[axis]);
      }
      const std::size_t axis = when[0] <= when[1] ? 0 : 1;
      Place crossing{};
      for (std::size_t i = 0; i < 2; ++i) crossing[i] = from[i] + when[axis] * (end[i] - from[i]);
      cross(axis, target[axis] > cell_[axis] ? 1 : -1, crossing);
    }
    at_ = end;
    if (pending_) inside_.push_back(end);
  }

  std::vector<StepRun> take() {
    flush();
    return std::move(runs_);
  }

 private:
  void cross(std::size_t axis, int sign, const Place& crossing) {
    if (pending_ && axis != axis_) {
      inside_.push_back(crossing);
      if (only_clips(axis, sign)) {
        std::array<int, 2> step{};
        step[axis_] = sign_;
        step[axis] = sign;
        add(step[0], step[1]);
        pending_ = false;
        cell_[axis] += sign;
        return;
      }
    }
    flush();
    pending_ = true;
    axis_ = axis;
    sign_ = sign;
    cell_[axis] += sign;
    inside_.assign(1, crossing);
  }

  // Whether what the path did in the cell it now leaves over (axis, sign) is well described by the diagonal past it.
  bool only_clips(std::size_t axis, int sign) const {
    return std::all_of(inside_.begin(), inside_.end(), [&](const Place& p) {
      const double back = (static_cast<double>(cell_[axis_]) - p[axis_]) * sign_;
      const double on = (p[axis] - static_cast<double>(cell_[axis])) * sign;
      // From the diagonal: |back + on - 1| / sqrt(2) <= 1/2.
      return back >= 0 && on >= 0 && 1 - back - on <= std::sqrt(0.5);
    });
  }

  void flush() {
    if (!pending_) return;
    pending_ = false;
    add(axis_ == 0 ? sign_ : 0, axis_ == 1 ? sign_ : 0);
  }

  void add(int dx, int dy) {
    if (runs_.empty() || runs_.back().dx != dx || runs_.back().dy != dy) runs_.push_back({dx, dy, 0});
    ++runs_.back().length;
  }

  Place at_;
  Cell cell_;
  bool pending_ = false;  // a step into cell_ that may yet become part of a diagonal
  std::size_t axis_ = 0;
  int sign_ = 0;
  std::vector<Place> inside_;  // where the path was in cell_ since that step
  std::vector<StepRun> runs_;
};

int sign_of(std::int64_t value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

}  // namespace

MilPoint MilGrid::nearest(const Point<MachineFrame>& p) const {
  const auto [x, y] = to_board(p);
  return {nearest_mil(x), nearest_mil(y)};
}

Point<MachineFrame> MilGrid::from_board(MilPoint p) const {
  return point<MachineFrame>(static_cast<double>(p.x) * kMillimetresPerMil,
                             travel_y_mm - static_cast<double>(p.y) * kMillimetresPerMil);
}

std::vector<StepRun> runs_along(const Polyline<MachineFrame>& path, const MilGrid& grid) {
  if (path.empty()) return {};
  const auto place = [&](const Point<MachineFrame>& p) {
    const auto [x, y] = grid.to_board(p);
    return Place{x, y};
  };
  Stepper stepper(place(path.front()));
  for (std::size_t i = 1; i < path.size(); ++i) stepper.line_to(place(path[i]));
  return stepper.take();
}

std::vector<StepRun> runs_between(MilPoint from, MilPoint to) {
  const std::int64_t x = to.x - from.x, y = to.y - from.y;
  const std::int64_t both = std::min(std::abs(x), std::abs(y));
  std::vector<StepRun> runs;
  if (both > 0) runs.push_back({sign_of(x), sign_of(y), both});
  if (std::abs(x) > both) runs.push_back({sign_of(x), 0, std::abs(x) - both});
  if (std::abs(y) > both) runs.push_back({0, sign_of(y), std::abs(y) - both});
  return runs;
}

}  // namespace veneer::lihuiyu
