// For every patch the best places of the whole stock, spread over it: what a joint optimisation chooses from.
//
// The wood is looked at region by region (squares of a third of a patch); in each, every patch keeps the one place,
// of a grid of positions and all rotations, that the sketch (sketch.h) finds cheapest. The best regions of each patch
// are thinned, laid on the matcher's lattice and measured exactly. A place stands on free wood; other placements are
// not looked at.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "planner/joint/assignment.h"
#include "planner/joint/footprint.h"
#include "planner/matching/matcher.h"
#include "planner/problem.h"

namespace veneer::planner {

struct SurveyOptions {
  std::size_t places = 300;  // a patch, at most; half as many slots
  int threads = 1;
};

// Two lists a task of the queue: places found, cheapest first, and the cheapest of the slots that were given, by their
// numbers.
struct Survey {
  std::vector<std::vector<Place>> places;
  std::vector<std::vector<Choice>> slots;
};

// Deterministic, any number of threads. Returns early, with anything, once `stop` is requested; `progress` is called on
// the calling thread with the share done.
Survey survey_places(const Problem& problem, const Matcher& matcher, std::span<const Footprint> footprints,
                     std::span<const Pose> slots, const SurveyOptions& options, const std::stop_token& stop,
                     const std::function<void(double)>& progress = {});

}  // namespace veneer::planner
