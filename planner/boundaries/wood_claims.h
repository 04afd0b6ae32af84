// What the wood around each placed piece would cost in the pixels around it, where it is the piece's to take.
//
// No margins are reserved when wood is chosen: the wood beside a piece that is free then, and nearer to it than to any
// other, is its own to grow into. Two pieces that keep to what is theirs keep the kerf between them.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "planner/boundaries/cut_lines.h"
#include "planner/matching/matcher.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// A face of a layout where it lies now. Without a placement it has no wood.
struct PlacedFace {
  const WorkingArtwork* artwork = nullptr;
  Ring<ArtworkFrame> outline;
  const std::optional<PatchPlacement>* placement = nullptr;
  cv::Rect window;  // the pixels that it may come to own
};

// For each face equation 4's summand at each pixel of its window, kForbidden where it must not be cut from there.
// `panels`: the wood without these pieces. `margin`: kept from wood that is not free and from other pieces on top of
// what is booked for the kerf. kCancelled: a stop was requested.
Result<std::vector<FaceCost>> wood_around(std::span<const PlacedFace> faces, const std::vector<MatchPanel>& panels,
                                          Millimetres margin, int threads, const std::stop_token& stop);

}  // namespace veneer::planner
