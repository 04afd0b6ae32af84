// The order in which pieces are burnt: short dark travel, inner pieces before those that surround them.
//
// Nearest neighbour from `start`, then 2-opt and Or-opt over centres until nothing improves. Deterministic: equal
// inputs give equal orders. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <vector>

#include "base/geometry.h"

namespace veneer::planner {

struct CutSite {
  Point<BedFrame> place;  // where the head enters and leaves
  // Indices of the sites that must be burnt before this one (pieces lying in one of its holes).
  std::vector<std::size_t> after;
};

// A permutation of the sites' indices in which every `after` holds. Cyclic demands are dropped.
std::vector<std::size_t> cut_order(const std::vector<CutSite>& sites, Point<BedFrame> start);

// Length of the open tour from `start` through the sites in this order.
Millimetres tour_length(const std::vector<CutSite>& sites, const std::vector<std::size_t>& order,
                        Point<BedFrame> start);

}  // namespace veneer::planner
