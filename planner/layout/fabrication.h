// Whether a piece can be cut and handled.
//
// Its body is what a disc of `width` can reach without leaving the piece (morphological opening). A piece is fabricable
// when the disc reaches all of its body from anywhere in it (else a neck is thinner than `width`), when nothing sticks
// out of the body farther than the tip of a corner of 45 degrees does (0.81 of `width`; else a part is thinner than
// that), and when it has at least `area`. Pure functions; thread-safe.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "base/geometry.h"

namespace veneer::planner {

struct FabricationLimits {
  Millimetres width{1.5};     // no part is thinner
  SquareMillimetres area{4};  // no piece is smaller
};
// The least area of a piece that can be handled, in squares of its least width: those above are such limits.
inline constexpr double kHandyArea = 16.0 / 9.0;

enum class FabricationFault { kCrossesItself, kTooSmall, kNeck, kThin };
// What is wrong, as it follows "piece A1-1 ": "is thinner than 1.5 mm in places".
std::string_view words_for(FabricationFault fault);

// The worst that is wrong with an outline; none: it can be cut. `places`, if given, gets points of the parts that are
// too thin, and nothing where the whole piece is at fault.
std::optional<FabricationFault> fault_of(const Ring<ArtworkFrame>& outline, const FabricationLimits& limits,
                                         std::vector<Point<ArtworkFrame>>* places = nullptr);

}  // namespace veneer::planner
