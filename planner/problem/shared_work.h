// What plans of the same wood need not each make anew: the index of that wood, and the saliency of their pictures.
//
// Plans do not depend on it: an index is taken over only where all that it was measured from is equal. Not for several
// threads at a time.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "planner/matching/cell_index.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/priority.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

class SharedWork {
 public:
  SaliencyMaps saliency;

  // The matcher of the plan before, all its wood free again, if one made for this problem would measure the same; the
  // problem's panels are then gone. None: it must be made. kCancelled: a stop was requested.
  Result<std::unique_ptr<Matcher>> matcher_for(Problem& problem, const PlanOptions& options, int threads,
                                               const std::stop_token& stop);
  // For the next plan: the matcher that was made, or taken over, for this problem. Its wood may be taken.
  void keep(std::unique_ptr<Matcher> matcher, const Problem& problem, const PlanOptions& options);

 private:
  // What a matcher was made for, but for its panels.
  struct Made {
    bool exact = false;
    int rotations = 0;
    double entries_per_unit = 0, largest_response = 0, thoroughness = 1;
    std::vector<WindowClass> classes;
    friend bool operator==(const Made&, const Made&) = default;
  };
  static Made made_for(const Problem& problem, const PlanOptions& options);

  std::unique_ptr<Matcher> matcher_;
  Made made_;
};

}  // namespace veneer::planner
