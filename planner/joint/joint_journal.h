// What the joint choice remembers in a plan's journal: the lists that it chooses from, once the wood is surveyed, and
// where its search stands between two stages. A plan that was killed then goes on with the stage that it was in.
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "planner/joint/joint_search.h"
#include "planner/plan_journal.h"

namespace veneer::planner {

class JointJournal {
 public:
  // `journal`: after greedy's steps; none: nothing is remembered. It outlives this.
  explicit JointJournal(PlanJournal* journal) : journal_(journal) {}

  // As an earlier run added them, bit for bit; none when it did not add them all, and none once `stop` is requested.
  std::optional<JointSearch::Lists> lists(std::size_t patches, const std::stop_token& stop);
  // Adds those that no earlier run has. Returns early once `stop` is requested; then a later run adds the rest.
  void add(const JointSearch::Lists& lists, const std::stop_token& stop);
  // The next state that an earlier run added, after the lists.
  std::optional<JointSearch::State> next_state(const JointSearch::Lists& lists);
  void add(const JointSearch::State& state);

 private:
  PlanJournal* journal_;
  std::size_t lists_ = 0;  // that the journal has
};

}  // namespace veneer::planner
