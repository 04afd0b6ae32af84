#include "planner/global/shelves.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

constexpr int kFinest = 128;  // steps along a rectangle's side, at most

int steps(double side) { return std::clamp(static_cast<int>(std::ceil(side)), 1, kFinest); }

}  // namespace

Shelves::Shelves(const Raster<PanelFrame>& free, int panel, Radians turn, const Spacing& spacing)
    : free_(free),
      panel_(panel),
      angle_(turn.count()),
      cos_(std::cos(angle_)),
      sin_(std::sin(angle_)),
      across_(steps(spacing.width)),
      down_(steps(spacing.height)),
      step_x_(spacing.width / across_),
      step_y_(spacing.height / down_) {
  left_ = top_ = std::numeric_limits<double>::infinity();
  double right = -left_, bottom = -top_;
  for (const double column : {0.0, static_cast<double>(free.pixels.cols)}) {
    for (const double row : {0.0, static_cast<double>(free.pixels.rows)}) {
      const double x = cos_ * column - sin_ * row, y = sin_ * column + cos_ * row;
      left_ = std::min(left_, x), right = std::max(right, x);
      top_ = std::min(top_, y), bottom = std::max(bottom, y);
    }
  }
  columns_ = static_cast<int>((right - left_) / step_x_) + 1, rows_ = static_cast<int>((bottom - top_) / step_y_) + 1;
}

Result<std::vector<std::vector<Pose>>> Shelves::filled(const std::stop_token& stop) {
  if (const Status found = find_runs(stop); !found.ok()) return found.error();
  std::map<std::size_t, std::vector<Run>> by_region;
  for (const Run& run : runs_) by_region[root(run.region)].push_back(run);
  std::vector<std::vector<Pose>> out;
  for (const auto& [region, runs] : by_region) {
    Result<std::vector<Pose>> poses = fill(runs, stop);
    if (!poses.ok()) return poses.error();
    out.push_back(*std::move(poses));
  }
  return out;
}

bool Shelves::is_free(double column, double row) const {
  const auto c = static_cast<int>(std::floor(column)), r = static_cast<int>(std::floor(row));
  return c >= 0 && r >= 0 && c < free_.pixels.cols && r < free_.pixels.rows &&
         free_.pixels.ptr<std::uint8_t>(r)[c] != 0;
}

Status Shelves::find_runs(const std::stop_token& stop) {
  // For each column, the rows on end, down to this one, in which a rectangle fits across.
  std::vector<int> height(static_cast<std::size_t>(columns_));
  covered_.assign(static_cast<std::size_t>(columns_), 0);
  coverer_.assign(static_cast<std::size_t>(columns_), 0);
  for (int j = 0; j < rows_; ++j) {
    if (stop.stop_requested()) return cancelled();
    const double y = top_ + j * step_y_;
    int free_points = 0, first = -1;
    const auto end_run = [&](int end) {
      if (first >= 0) add_run({j - down_, first, end - 1, 0});
      first = -1;
    };
    for (int i = 0; i < columns_; ++i) {
      const double x = left_ + i * step_x_;
      free_points = is_free(cos_ * x + sin_ * y, cos_ * y - sin_ * x) ? free_points + 1 : 0;
      if (i < across_) continue;
      int& here = height[static_cast<std::size_t>(i - across_)];
      here = free_points > across_ ? here + 1 : 0;
      if (here <= down_)
        end_run(i - across_);
      else if (first < 0)
        first = i - across_;
    }
    end_run(columns_ - across_);
  }
  return Ok();
}

// Joins the run to the regions that its rectangles overlap.
void Shelves::add_run(Run run) {
  run.region = parents_.size();
  parents_.push_back(run.region);
  for (int i = run.first; i < run.last + across_; ++i) {
    const auto column = static_cast<std::size_t>(i);
    if (covered_[column] > run.row) {
      const std::size_t a = root(run.region), b = root(coverer_[column]);
      parents_[std::max(a, b)] = std::min(a, b);
    }
    covered_[column] = run.row + down_;
    coverer_[column] = run.region;
  }
  runs_.push_back(run);
}

std::size_t Shelves::root(std::size_t region) {
  while (parents_[region] != region) region = parents_[region] = parents_[parents_[region]];
  return region;
}

// `runs` are those of one region.
Result<std::vector<Pose>> Shelves::fill(const std::vector<Run>& runs, const std::stop_token& stop) const {
  const int top = runs.front().row, count = runs.back().row - top + 1;
  std::vector<std::vector<int>> row(static_cast<std::size_t>(count));  // left points of the rectangles of a row
  for (const Run& run : runs) {
    if (stop.stop_requested()) return cancelled();
    std::vector<int>& lefts = row[static_cast<std::size_t>(run.row - top)];
    int next = lefts.empty() ? run.first : std::max(run.first, lefts.back() + across_);
    for (; next <= run.last; next += across_) lefts.push_back(next);
  }
  // most[r]: what rows above r can hold together.
  std::vector<std::size_t> most(static_cast<std::size_t>(count) + 1, 0);
  for (int r = 0; r < count; ++r) {
    const auto k = static_cast<std::size_t>(r), clear = static_cast<std::size_t>(std::max(0, r + 1 - down_));
    most[k + 1] = std::max(most[k], most[clear] + row[k].size());
  }
  std::vector<Pose> poses;
  for (int r = count - 1; r >= 0;) {
    const auto k = static_cast<std::size_t>(r);
    if (most[k + 1] == most[k]) {
      --r;
      continue;
    }
    for (const int left : row[k]) poses.push_back(pose(left, top + r));
    r -= down_;
  }
  return poses;
}

Pose Shelves::pose(int left, int top) const {
  const double x = left_ + (left + across_ / 2.0) * step_x_, y = top_ + (top + down_ / 2.0) * step_y_;
  const Point<PanelFrame> centre = free_.from_pixels(cos_ * x + sin_ * y, cos_ * y - sin_ * x);
  return pose_at(panel_, centre.x.count(), centre.y.count(), angle_);
}

}  // namespace veneer::planner
