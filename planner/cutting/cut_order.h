// The order in which pieces are burnt, and where each is entered: short dark travel, inner pieces before those that
// surround them, no two neighbours one right after the other while the first is hot.
//
// A site is a piece; a way is one manner to burn it: where the head must come to, where it is left, and what the way
// costs in itself. Nearest neighbour from `start`, then 2-opt and Or-opt over near sites; given an order, the ways are
// the best there are (dynamic programming). Deterministic: equal inputs give equal orders. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <vector>

#include "base/geometry.h"

namespace veneer::planner {

struct CutWay {
  Point<BedFrame> in, out;  // finite: a tour through infinity would never end
  Millimetres inner{0};     // dark travel within the piece, and what else speaks against this way
};

struct CutSite {
  std::vector<CutWay> ways;  // at least one
  // Sites so near to this one that they are not burnt right before or after it if that can be avoided, because the
  // wood between is still hot. Sorted; of two sites each names the other.
  std::vector<std::size_t> hot;
  // Indices of the sites that must be burnt before this one (pieces lying in one of its holes).
  std::vector<std::size_t> after;
};

struct CutVisit {
  std::size_t site = 0;
  std::size_t way = 0;
  friend bool operator==(const CutVisit&, const CutVisit&) = default;
};

struct CutOrderOptions {
  Point<BedFrame> start{};  // where the head is
  bool as_given = false;    // keep the order of the sites; only the ways are chosen
};

// Every site once, and every `after` holds. Cyclic demands are dropped.
std::vector<CutVisit> cut_order(const std::vector<CutSite>& sites, const CutOrderOptions& options);

// How often a site follows one that is still hot.
std::size_t hot_pairs(const std::vector<CutSite>& sites, const std::vector<CutVisit>& visits);

}  // namespace veneer::planner
