// Borders of layouts without lines across: mosaics, segmentations, triangles. Every edge is cut by itself, within the
// strip around it that is its own (edge_strip.h), and then again from where it is; where edges meet stays where it is.
#pragma once

#include <stop_token>
#include <vector>

#include "planner/boundaries/borders.h"
#include "planner/boundaries/edge_strip.h"

namespace veneer::planner {

class EdgeCuts : public Borders {
 public:
  // All artworks of the problem have a layout.
  EdgeCuts(const Problem& problem, const std::vector<MatchPanel>& panels, const BoundaryOptions& options);

  // An edge beside a piece that could not be made, or would not keep to its wood, stays where it was.
  Status cut(const PatchPlacements& placements, const std::stop_token& stop) override;

 private:
  // An edge between two faces.
  struct Inner {
    std::size_t artwork, edge;
  };
  using Strips = std::vector<EdgeStrip>;  // one an inner edge
  // How far inner edges go aside from where they are, place by place along their strips.
  using Offsets = std::vector<std::vector<double>>;
  std::vector<PlanePoint> path_of(std::size_t artwork, const PartitionEdge& edge) const;
  // Around the edges where they are now. kCancelled: a stop was requested.
  Result<Strips> strips(const std::stop_token& stop) const;
  PartitionEdge drawn(const Inner& inner, const EdgeStrip& strip, const std::vector<double>& offsets) const;
  // What goes as far as it did `before`, in `like`, is taken from there.
  State drawn(const Strips& strips, const Offsets& offsets, const Offsets& before, const State& like) const;
  Result<Offsets> proposal(const Strips& strips, const std::vector<FaceCost>& costs, const std::stop_token& stop) const;
  // Draws back the edges of pieces that are not sound. Whether there are any.
  bool draw_back(const std::vector<PieceFaults::Fault>& bad, const Strips& strips, const State& next,
                 const Offsets& offsets, int times, Offsets& shares) const;

  std::vector<std::vector<std::vector<PlanePoint>>> home_;  // of each artwork's edges, as the layout has them
  std::vector<Inner> inner_;                                // of all artworks
  std::vector<std::vector<std::size_t>> edges_of_task_;     // as places in inner_
};

}  // namespace veneer::planner
