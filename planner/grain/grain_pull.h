// What a piece's grain adds to its cost where pieces are chosen together: the more, the more it crosses the direction
// that the picture would like there. It decides between places; costs that are reported are equation 4 alone.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/poses/footprint.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

class GrainPull {
 public:
  // With w_grain 0 there is none, and all costs are 0. Both outlive this.
  GrainPull(const Problem& problem, const std::vector<MatchPanel>& panels, double w_grain);

  bool is_there() const { return w_grain_ > 0; }
  double cost(std::size_t task, const Pose& pose) const { return is_there() ? cost_of(task, wood(pose)) : 0; }

  // The wood's direction in the artwork, were it cut there.
  cv::Vec2f wood(const Pose& pose) const;
  cv::Vec2f wanted(std::size_t task) const { return wanted_[task]; }
  // w_grain^2 for each pixel of the patch: of a piece that crosses it at right angles, both being sure.
  double most(std::size_t task) const;
  // The same times how much the directions disagree.
  double cost_of(std::size_t task, const cv::Vec2f& wood) const;

 private:
  const Problem& problem_;
  const std::vector<MatchPanel>& panels_;
  double w_grain_;
  std::vector<cv::Vec2f> wanted_;  // of each task of the queue
};

}  // namespace veneer::planner
