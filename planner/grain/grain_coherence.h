// How calm an assembled picture is: whether the grain of neighbouring pieces runs the same way. Pure.
#pragma once

#include <cstddef>
#include <optional>

#include "planner/plan.h"

namespace veneer::planner {

// Sums over neighbours of the assembled picture itself. Of each piece the direction of its grain is that across which
// its tone changes most; pieces without a direction count little.
struct GrainCoherence {
  double agreement = 0, weight = 0;
  GrainCoherence& operator+=(const GrainCoherence& other) {
    agreement += other.agreement, weight += other.weight;
    return *this;
  }
  // The mean of cos(2 * angle between the grain of two neighbours), by the length of their border: 1, all runs one way;
  // 0, without order; -1, each crosses its neighbours. None without neighbours.
  std::optional<double> mean() const { return weight > 0 ? std::optional(agreement / weight) : std::nullopt; }
};

// `preview` is what assemble_preview() gives of this artwork, at any resolution.
GrainCoherence grain_coherence(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview);

}  // namespace veneer::planner
