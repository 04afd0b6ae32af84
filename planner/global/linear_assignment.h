// The linear assignment problem on a sparse, rectangular matrix of costs, solved exactly by shortest augmenting paths
// (Jonker and Volgenant 1987).
//
// Deterministic; one thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"

namespace veneer::planner {

// One entry of a row: a column that it may be assigned, and the cost.
struct AssignmentCost {
  std::uint32_t column = 0;
  double cost = 0;
};

// For each row the column it is assigned, at the least total cost; none: it is left unassigned, for its price in
// `unassigned`. No column is assigned twice, no row names one twice, and `columns` says how many there are. kCancelled:
// a stop was requested.
Result<std::vector<std::optional<std::uint32_t>>> solve_linear_assignment(
    std::span<const std::vector<AssignmentCost>> rows, std::span<const double> unassigned, std::size_t columns,
    const std::stop_token& stop);

}  // namespace veneer::planner
