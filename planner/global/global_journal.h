// What the global choice remembers in a plan's journal: the lists that it chooses from, once the wood is surveyed, and
// where its search stands between two stages and at its end. A plan that was killed then goes on with the stage that it
// was in.
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "planner/files/plan_journal.h"
#include "planner/global/global_search.h"

namespace veneer::planner {

class GlobalJournal {
 public:
  // `journal`: after greedy's steps; none: nothing is remembered. It outlives this.
  explicit GlobalJournal(PlanJournal* journal) : journal_(journal) {}

  // As an earlier run added them, bit for bit; none when it did not add them all. kCancelled: a stop was requested.
  Result<std::optional<GlobalSearch::Lists>> lists(std::size_t patches, const std::stop_token& stop);
  // Adds those that no earlier run has. kCancelled: a stop was requested; a later run adds the rest.
  Status add(const GlobalSearch::Lists& lists, const std::stop_token& stop);
  // The next state that an earlier run added, after the lists.
  std::optional<GlobalSearch::State> next_state(const GlobalSearch::Lists& lists);
  void add(const GlobalSearch::State& state);
  bool is_behind() const { return journal_ != nullptr && journal_->is_behind(); }

 private:
  PlanJournal* journal_;
  std::size_t lists_ = 0;  // that the journal has
};

}  // namespace veneer::planner
