// Of a picture for which the free wood does not suffice: a smaller size, and smaller patches, for which it does.
// Nothing is computed from areas: each answer was planned on the same wood, and every patch of it has some.
#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "planner/plan.h"

namespace veneer::planner {

struct FittingSize {
  Millimetres size;   // of the picture's shorter side, at most as asked for
  Millimetres patch;  // PlanOptions::patch
  friend bool operator==(const FittingSize&, const FittingSize&) = default;
};

struct FittingLimits {
  Millimetres least_patch{5};                // no smaller patches are tried; nor any below PlanOptions::min_size
  Duration time = std::chrono::seconds(30);  // for all tries together, by `clock`
};

struct FoundSizes {
  std::vector<FittingSize> sizes;
  int tried = 0;  // sizes and patches of which it came out whether it fits
};

// At most two sizes: the largest size found with the patches as they are, and a larger size (perhaps the whole) found
// with patches of half the side, rounded down to 0.5 mm. Sizes are found by bisection, in whole millimetres, so a
// larger one than is told may fit; none is smaller than a patch or a tenth of `artwork`. None: none of what was tried
// in that time fits, which does not mean that nothing does; and it may be that nothing was.
//
// `options` are those of the plan that found too little wood. What only betters a plan once each patch has its wood
// (global choice, fine rotation, refined borders, alternatives) is left out of the tries, and no index is kept of the
// wood: PlanOptions::index_cache stays as that plan left it. REQUIRES: nothing is kept of an earlier plan.
//
// Blocks for about `limits.time` at most, measured where make_plan reports progress. kCancelled: a stop was requested.
// Otherwise as make_plan while nothing is found; but what it refuses as kInvalidArgument at a smaller size or patch
// just does not fit.
Result<FoundSizes> fitting_sizes(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
                                 const FittingLimits& limits, const Clock& clock, const Progress& progress = {},
                                 const std::stop_token& stop = {});

// Half of `patch`, as it is tried; none where it would be smaller than allowed.
std::optional<Millimetres> smaller_patch(const PlanOptions& options, Millimetres least);

// "with its shorter side 45 mm and patches of 10 mm, or 60 mm and patches of 5 mm". REQUIRES: not empty.
std::string words_of(const std::vector<FittingSize>& sizes);

}  // namespace veneer::planner
