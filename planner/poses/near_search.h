// Every pose within a few pixels of another, at its angle: the wood there is turned upright once and the patch is
// compared with it pixel by pixel.
//
// Costs are equation 4 in single precision (within a millionth of placement_cost()), in a fixed order of additions, the
// same on every machine. Thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"

namespace veneer::planner {

class NearSearch {
 public:
  // All outlive this.
  NearSearch(const MatchPatch& patch, const Footprint& footprint, const std::vector<MatchPanel>& panels);

  // The cheapest candidate that is whole pixels (along the patch's sides, at most `reach` each way) from `from` and
  // that `allowed` accepts; of a large patch the cheapest by some of its rows. The same pose counts too.
  std::optional<Candidate> best(const Pose& from, int reach, const std::function<bool(const Pose&)>& allowed) const;
  double cost(const Pose& at) const;

 private:
  void turn_upright(const Pose& from, int reach, std::vector<float>& wood) const;
  float distance(const std::vector<float>& wood, int wood_columns, int right, int down, int step) const;

  const MatchPatch& patch_;
  const Footprint& footprint_;
  const std::vector<MatchPanel>& panels_;
  std::size_t channels_;
};

}  // namespace veneer::planner
