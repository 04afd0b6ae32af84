#include "planner/global/linear_assignment.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

using Rows = std::vector<std::vector<AssignmentCost>>;

// All there are, one by one.
double least_cost(const Rows& rows, const std::vector<double>& unassigned, std::vector<bool>& taken, std::size_t i) {
  if (i == rows.size()) return 0;
  double least = unassigned[i] + least_cost(rows, unassigned, taken, i + 1);
  for (const AssignmentCost& entry : rows[i]) {
    if (taken[entry.column]) continue;
    taken[entry.column] = true;
    least = std::min(least, entry.cost + least_cost(rows, unassigned, taken, i + 1));
    taken[entry.column] = false;
  }
  return least;
}

RC_GTEST_PROP(Assignment, CostsAsLittleAsAnyThatTakesNocolumnTwice, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(0, 7), columns = *rc::gen::inRange<std::size_t>(1, 6);
  Rows rows(count);
  std::vector<double> unassigned;
  for (auto& mine : rows) {
    for (std::uint32_t column = 0; column < columns; ++column)
      if (*rc::gen::arbitrary<bool>()) mine.push_back({column, *rc::gen::inRange(0, 30) / 10.0});
    unassigned.push_back(*rc::gen::inRange(0, 60) / 10.0);
  }
  const auto assigned = solve_linear_assignment(rows, unassigned, columns, {});
  RC_ASSERT(assigned.ok() && assigned->size() == count);
  std::vector<bool> gone(columns);
  double cost = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!(*assigned)[i]) {
      cost += unassigned[i];
      continue;
    }
    const auto entry = std::find_if(rows[i].begin(), rows[i].end(),
                                    [&](const AssignmentCost& it) { return it.column == (*assigned)[i]; });
    RC_ASSERT(entry != rows[i].end());
    RC_ASSERT(!gone[entry->column]);
    gone[entry->column] = true, cost += entry->cost;
  }
  std::vector<bool> none(columns);
  RC_ASSERT(std::abs(cost - least_cost(rows, unassigned, none, 0)) < 1e-9);
}

TEST(LinearAssignment, LeavesTheRowUnassignedThatCostsLeast) {
  const Rows rows{{{0, 1}}, {{0, 1}, {1, 5}}, {{1, 1}}};
  const auto assigned = solve_linear_assignment(rows, std::vector<double>{100, 300, 200}, 2, {});
  ASSERT_TRUE(assigned.ok());
  EXPECT_FALSE((*assigned)[0].has_value());
  EXPECT_EQ((*assigned)[1], 0U);
  EXPECT_EQ((*assigned)[2], 1U);
}

TEST(LinearAssignment, IsCancelledOnceAStopIsRequested) {
  std::stop_source stop;
  stop.request_stop();
  const auto assigned = solve_linear_assignment(Rows{{{0, 1}}}, std::vector<double>{9}, 1, stop.get_token());
  ASSERT_FALSE(assigned.ok());
  EXPECT_EQ(assigned.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer::planner
