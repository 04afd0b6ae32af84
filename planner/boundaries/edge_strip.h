// The surroundings of one edge of a partition as a strip, and the cheapest way through it (paper, section 3.4,
// equations 8 and 9, for edges that run anywhere).
//
// A strip is as long as its edge, step by step of about a pixel, and goes aside from it along its normals, as far as
// the pixels are nearer to this edge than to any other: whatever goes on there is between the two faces beside the
// edge, and what two edges do in their strips never meets. So edges are cut each by itself, in any order.
// Lengths are pixels of the working resolution, rows from above. Aside is positive towards the face on the left.
#pragma once

#include <span>
#include <vector>

#include "planner/boundaries/cut_lines.h"
#include "planner/layout/bezier_fit.h"

namespace veneer::planner {

class EdgeStrip {
 public:
  // `path`: the way along the edge, its ends included. `home`: where the layout has it, from which it goes no farther
  // than `reach`. `others`: all other edges near by. `gap`: kept from what they may do in their strips, but where edges
  // meet.
  EdgeStrip(std::span<const PlanePoint> path, const std::vector<PlanePoint>& home,
            std::span<const std::vector<PlanePoint>> others, double reach, double gap);

  // Places along the edge that may go aside, both ends among them.
  std::size_t size() const { return points_.size(); }
  double length() const { return static_cast<double>(points_.size() - 1); }  // to half a pixel
  PlanePoint at(std::size_t i, double aside) const {
    return {points_[i].x + aside * normals_[i].x, points_[i].y + aside * normals_[i].y};
  }

  // What it costs to go aside, place by place: so many pixels of the one face become the other's.
  struct Costs {
    std::vector<double> sums;  // for each place along and whole pixel aside
  };
  Costs costs(const FaceCost& left, const FaceCost& right) const;

  // How far aside the cheapest way goes at each place, of all that begin and end where the edge does: a cubic B-spline
  // with controls every `stride`, whose turns there, in sixths of the stride, cost their squares times `bend`. It never
  // leans by more than 40 degrees from the edge.
  std::vector<double> cheapest(const Costs& costs, double stride, double bend) const;

 private:
  double cost_of_part(const Costs& costs, double from, double to, double begin, double end) const;
  std::vector<double> spline(const std::vector<double>& controls) const;

  double reach_;
  std::size_t width_;  // whole pixels aside, on both sides together
  std::vector<PlanePoint> points_, normals_;
  std::vector<double> low_, high_;  // how far aside each place may go
};

}  // namespace veneer::planner
