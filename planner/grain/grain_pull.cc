#include "planner/grain/grain_pull.h"

#include "planner/grain/grain_field.h"

namespace veneer::planner {

GrainPull::GrainPull(const Problem& problem, const std::vector<MatchPanel>& panels, double w_grain)
    : problem_(problem), panels_(panels), w_grain_(w_grain) {
  if (!is_there()) return;
  for (const Problem::Task& task : problem.queue) {
    const Box<ArtworkFrame> box = bounds(task.match.outline);
    wanted_.push_back(direction_at(problem.artworks[task.artwork].grain, ((box.min.x + box.max.x) / 2).count(),
                                   (task.match.grid.height - (box.min.y + box.max.y) / 2).count()));
  }
}

cv::Vec2f GrainPull::wood(const Pose& pose) const {
  const MatchPanel& panel = panels_[static_cast<std::size_t>(pose.panel)];
  double column = 0, row = 0;
  panel.features.to_pixels(point<PanelFrame>(pose.x, pose.y), column, row);
  const ScanResolution& resolution = panel.features.resolution;
  // The pose turns the artwork on to the panel; the wood turns back.
  return turned(
      direction_at(panel.grain, resolution.to_mm(Pixels(column)).count(), resolution.to_mm(Pixels(row)).count()),
      pose.cos, -pose.sin);
}

double GrainPull::most(std::size_t task) const {
  return w_grain_ * w_grain_ * static_cast<double>(problem_.queue[task].match.pixels.count);
}

double GrainPull::cost_of(std::size_t task, const cv::Vec2f& wood) const {
  return most(task) * disagreement(wanted_[task], wood);
}

}  // namespace veneer::planner
