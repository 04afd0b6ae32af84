#include "planner/global/linear_assignment.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNoRow = std::numeric_limits<std::uint32_t>::max();

// Rows enter one after the other, each along the shortest augmenting path. The dual variables keep every reduced cost
// at or above zero and those of assigned entries at zero, so that each search is Dijkstra's.
class LinearAssignment {
 public:
  LinearAssignment(std::span<const std::vector<AssignmentCost>> rows, std::span<const double> unassigned,
                   std::size_t columns, const std::stop_token& stop)
      : rows_(rows),
        unassigned_(unassigned),
        stop_(stop),
        column_of_(rows.size()),
        row_dual_(rows.size(), 0),
        row_of_(columns, kNoRow),
        column_dual_(columns, 0),
        distance_(columns, kInfinity),
        is_settled_(columns),
        reached_from_(columns, kNoRow) {}

  // Half done once a stop is requested.
  void augment(std::uint32_t added) {
    reached_.clear(), settled_.clear(), open_ = {};
    double least = unassigned_[added];         // of all paths known so far
    std::optional<std::uint32_t> free_column;  // where it ends, or
    std::uint32_t left_out = added;            // the row that is left unassigned
    reach_from(added, 0);
    while (!open_.empty() && open_.top().first < least && !stop_.stop_requested()) {
      const auto [distance, column] = open_.top();
      open_.pop();
      if (distance > distance_[column]) continue;  // reached by a shorter way since
      const std::uint32_t row = row_of_[column];
      if (row == kNoRow) {
        least = distance, free_column = column;
        break;
      }
      settled_.push_back(column), is_settled_[column] = true;
      if (distance + unassigned_[row] - row_dual_[row] < least)
        least = distance + unassigned_[row] - row_dual_[row], left_out = row;
      reach_from(row, distance - row_dual_[row]);
    }
    for (const std::uint32_t column : settled_) {
      column_dual_[column] += distance_[column] - least;
      row_dual_[row_of_[column]] += least - distance_[column];
    }
    row_dual_[added] = least;
    reassign_along(added, left_out, free_column);
    for (const std::uint32_t column : reached_) distance_[column] = kInfinity, is_settled_[column] = false;
  }

  std::vector<std::optional<std::uint32_t>> columns() && { return std::move(column_of_); }

 private:
  void reach_from(std::uint32_t row, double distance) {
    for (const AssignmentCost& entry : rows_[row]) {
      const double there = distance + entry.cost - column_dual_[entry.column];
      // What is settled stays, whatever rounding says.
      if (is_settled_[entry.column] || !(there < distance_[entry.column])) continue;
      if (distance_[entry.column] == kInfinity) reached_.push_back(entry.column);
      distance_[entry.column] = there, reached_from_[entry.column] = row;
      open_.emplace(there, entry.column);
    }
  }

  // Backwards from the path's end.
  void reassign_along(std::uint32_t added, std::uint32_t left_out, std::optional<std::uint32_t> column) {
    if (!column) column = std::exchange(column_of_[left_out], std::nullopt);
    if (!column) return;  // the added row itself
    for (std::uint32_t row = kNoRow; row != added;) {
      row = reached_from_[*column];
      row_of_[*column] = row;
      column = std::exchange(column_of_[row], column);
    }
  }

  std::span<const std::vector<AssignmentCost>> rows_;
  std::span<const double> unassigned_;
  const std::stop_token& stop_;
  std::vector<std::optional<std::uint32_t>> column_of_;
  std::vector<double> row_dual_;
  std::vector<std::uint32_t> row_of_;
  std::vector<double> column_dual_;  // at most 0
  // Of the search under way:
  std::vector<double> distance_;
  std::vector<bool> is_settled_;
  std::vector<std::uint32_t> reached_from_, reached_, settled_;
  std::priority_queue<std::pair<double, std::uint32_t>, std::vector<std::pair<double, std::uint32_t>>, std::greater<>>
      open_;
};

}  // namespace

Result<std::vector<std::optional<std::uint32_t>>> solve_linear_assignment(
    std::span<const std::vector<AssignmentCost>> rows, std::span<const double> unassigned, std::size_t columns,
    const std::stop_token& stop) {
  LinearAssignment assignment(rows, unassigned, columns, stop);
  for (std::uint32_t i = 0; i < rows.size() && !stop.stop_requested(); ++i) assignment.augment(i);
  if (stop.stop_requested()) return cancelled();
  return std::move(assignment).columns();
}

}  // namespace veneer::planner
