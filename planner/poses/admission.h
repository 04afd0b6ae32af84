// Which patches may take the places that are wished for them.
//
// Searches keep to the wood by footprints and rasters, which are quick; the last word is free_wood.h's. Where it
// refuses a place, one patch goes back to where it was, and whoever took its place too, but not everybody.
#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/matcher.h"

namespace veneer::planner {

struct PlacedOutline {
  int panel = 0;
  Ring<PanelFrame> outline;
  friend bool operator==(const PlacedOutline&, const PlacedOutline&) = default;
};
using PlacedOutlines = std::vector<std::optional<PlacedOutline>>;  // one a patch; none: unfilled

// Of each patch whether it takes its wished place; all others stay where they were, `before`, which is not questioned.
// Patches are asked in their order: of two that wish for the same wood the first has it, if nobody has to stay there.
// kCancelled: a stop was requested.
Result<std::vector<bool>> admitted(const PlacedOutlines& wished, const PlacedOutlines& before,
                                   const std::vector<MatchPanel>& panels, const std::stop_token& stop = {});

}  // namespace veneer::planner
