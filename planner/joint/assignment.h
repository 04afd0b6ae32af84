// Who takes which of many things at the least total cost: a sparse assignment, solved exactly by shortest augmenting
// paths (Jonker and Volgenant 1987).
//
// Deterministic; one thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

namespace veneer::planner {

// One thing that somebody may take.
struct Choice {
  std::uint32_t thing = 0;
  double cost = 0;
};

// For each of `choices` (nobody's names a thing twice) the thing that is taken; none: it goes without, for the price in
// `without`. No thing is taken twice. `things`: how many there are. Returns early, with anything, once `stop` is
// requested.
std::vector<std::optional<std::uint32_t>> assign(std::span<const std::vector<Choice>> choices,
                                                 std::span<const double> without, std::size_t things,
                                                 const std::stop_token& stop);

}  // namespace veneer::planner
