#include "planner/poses/arrangement.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {

Arrangement::Arrangement(std::span<const Footprint> footprints, const std::vector<MatchPanel>& panels)
    : footprints_(footprints), poses_(footprints.size()), side_(1e-3) {
  for (const Footprint& footprint : footprints) side_ = std::max(side_, 2 * footprint.outer());
  for (const MatchPanel& panel : panels) {
    const Raster<PanelFrame>& wood = panel.features;
    Grid grid{wood.origin.x.count(), wood.origin.y.count(), 1, 1, {}};
    grid.columns += static_cast<int>(wood.width().count() / side_);
    grid.rows += static_cast<int>(wood.height().count() / side_);
    grid.cells.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows));
    grids_.push_back(std::move(grid));
  }
}

std::vector<std::size_t>& Arrangement::cell(const Pose& pose) {
  Grid& grid = grids_[static_cast<std::size_t>(pose.panel)];
  const int column = std::clamp(static_cast<int>((pose.x - grid.left) / side_), 0, grid.columns - 1);
  const int row = std::clamp(static_cast<int>((pose.y - grid.bottom) / side_), 0, grid.rows - 1);
  return grid
      .cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) + static_cast<std::size_t>(column)];
}

void Arrangement::put(std::size_t patch, const Pose& pose) {
  remove(patch);
  poses_[patch] = pose;
  cell(pose).push_back(patch);
}

void Arrangement::remove(std::size_t patch) {
  if (!poses_[patch]) return;
  std::vector<std::size_t>& there = cell(*poses_[patch]);
  *std::find(there.begin(), there.end(), patch) = there.back();
  there.pop_back();
  poses_[patch].reset();
}

// Stops once visit() returns false.
template <class Visit>
void Arrangement::visit_near(const Pose& pose, Visit visit) const {
  const Grid& grid = grids_[static_cast<std::size_t>(pose.panel)];
  const int column = std::clamp(static_cast<int>((pose.x - grid.left) / side_), 0, grid.columns - 1);
  const int row = std::clamp(static_cast<int>((pose.y - grid.bottom) / side_), 0, grid.rows - 1);
  for (int r = std::max(0, row - 1); r <= std::min(grid.rows - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(grid.columns - 1, column + 1); ++c)
      for (const std::size_t patch : grid.cells[static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.columns) +
                                                static_cast<std::size_t>(c)])
        if (!visit(patch)) return;
}

void Arrangement::in_the_way(std::size_t patch, const Pose& pose, std::vector<std::size_t>& found) const {
  visit_near(pose, [&](std::size_t other) {
    if (other != patch && Footprint::overlap(footprints_[patch], pose, footprints_[other], *poses_[other]))
      found.push_back(other);
    return true;
  });
}

std::optional<std::size_t> Arrangement::any_in_the_way(std::size_t patch, const Pose& pose) const {
  std::optional<std::size_t> found;
  visit_near(pose, [&](std::size_t other) {
    if (other != patch && Footprint::overlap(footprints_[patch], pose, footprints_[other], *poses_[other]))
      found = other;
    return !found;
  });
  return found;
}

}  // namespace veneer::planner
