// Which patches lie where, with fast answers to what is in the way of a pose. Numbers are the patches' places in the
// queue. Not thread-safe while put() or remove() runs.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"

namespace veneer::planner {

class Arrangement {
 public:
  // `footprints`: one a patch, alive as long as this.
  Arrangement(std::span<const Footprint> footprints, const std::vector<MatchPanel>& panels);

  void put(std::size_t patch, const Pose& pose);
  void remove(std::size_t patch);
  const std::optional<Pose>& pose(std::size_t patch) const { return poses_[patch]; }

  // Patches whose footprint overlaps that of `patch` at `pose`; itself never. Appended to `found`, in no useful order
  // but always the same.
  void in_the_way(std::size_t patch, const Pose& pose, std::vector<std::size_t>& found) const;
  // One of them.
  std::optional<std::size_t> any_in_the_way(std::size_t patch, const Pose& pose) const;

 private:
  struct Grid {
    double left, bottom;
    int columns, rows;
    std::vector<std::vector<std::size_t>> cells;
  };
  std::vector<std::size_t>& cell(const Pose& pose);
  template <class Visit>
  void visit_near(const Pose& pose, Visit visit) const;

  std::span<const Footprint> footprints_;
  std::vector<std::optional<Pose>> poses_;
  double side_;  // of a cell: no footprint reaches further than into the next
  std::vector<Grid> grids_;
};

}  // namespace veneer::planner
