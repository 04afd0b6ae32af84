// Wood chosen again for pieces of real shapes.
//
// The wood is surveyed once, for the layout's own patches, with far more candidates than the global choice needs. For
// the shapes of each round they are measured again, coarsely and then exactly, and all pieces choose among them
// together (global_search.h), starting from where they lie and at temperatures so low that hardly any move to a dearer
// arrangement is taken.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "planner/global/global_search.h"
#include "planner/grain/grain_pull.h"
#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct RematchOptions {
  std::size_t candidates = 1000;    // a patch, of the survey
  std::size_t measured = 150;       // of them, a round
  std::uint64_t iterations = 1200;  // a patch and round
  int threads = 1;
  std::uint64_t seed = 1;
  double w_grain = 0;
};

// Not thread-safe. Problem and matcher outlive this.
class Rematch {
 public:
  // kCancelled: a stop was requested.
  static Result<Rematch> survey(const Problem& problem, const Matcher& matcher, const RematchOptions& options,
                                const std::stop_token& stop);

  // Placements for these outlines (one a task, about where the task's own outline lies), no dearer than `placements`
  // are for them; poses keep to the wood by footprints, the last word is free_wood.h's. kCancelled: a stop was
  // requested.
  Result<PatchPlacements> choose(const std::vector<Ring<ArtworkFrame>>& outlines, const PatchPlacements& placements,
                                 std::uint64_t round, const std::stop_token& stop) const;

 private:
  Rematch(const Problem& problem, const Matcher& matcher, const RematchOptions& options);
  bool is_clear(const MatchPatch& patch, const PatchPlacement& placement) const;

  const Problem& problem_;
  const Matcher& matcher_;
  RematchOptions options_;
  GrainPull grain_;
  std::vector<std::vector<PatchPlacement>> known_;  // of each task
  std::vector<cv::Mat> clearance_;                  // of each panel: CV_32FC1, pixels to the next that is not free
};

}  // namespace veneer::planner
