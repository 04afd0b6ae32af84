#include "daemon/unit/cell_state.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace veneer::daemon {
namespace {

std::vector<CellState> all_states() {
  std::vector<CellState> states;
  for (int i = 0; i <= static_cast<int>(CellState::kClearing); ++i) states.push_back(static_cast<CellState>(i));
  return states;
}

std::vector<CellCommand> all_commands() {
  std::vector<CellCommand> commands;
  for (int i = 0; i <= static_cast<int>(CellCommand::kRecut); ++i) commands.push_back(static_cast<CellCommand>(i));
  return commands;
}

TEST(CellState, EveryNameIsUnique) {
  std::set<std::string_view> names;
  for (auto s : all_states()) names.insert(to_string(s));
  EXPECT_EQ(names.size(), 17U);
}

TEST(CellState, CommandWordsAreReadBack) {
  for (auto c : all_commands()) EXPECT_EQ(command_from_string(to_string(c)), c);
  EXPECT_FALSE(command_from_string("resume"));
}

TEST(CellState, AbortedIsLeftOnlyByClear) {
  for (auto c : all_commands()) EXPECT_EQ(after(CellState::kAborted, c).has_value(), c == CellCommand::kClear);
}

TEST(CellState, SuspendedIsLeftOnlyByAWord) {
  for (auto c : all_commands()) {
    const auto next = after(CellState::kSuspended, c);
    if (!next) continue;
    EXPECT_TRUE(c == CellCommand::kUnsuspend || c == CellCommand::kRecut || c == CellCommand::kStop ||
                c == CellCommand::kAbort)
        << to_string(c);
  }
}

TEST(CellState, UnholdWorksOnlyFromHeld) {
  for (auto s : all_states()) EXPECT_EQ(after(s, CellCommand::kUnhold).has_value(), s == CellState::kHeld);
}

TEST(CellState, AbortIsAllowedWhereverSomethingCouldMove) {
  for (auto s : all_states()) {
    if (s == CellState::kAborting || s == CellState::kAborted) continue;
    EXPECT_EQ(after(s, CellCommand::kAbort), CellState::kAborting) << to_string(s);
  }
}

TEST(CellState, AbortIsTakenEverywhereButWhereItIsGoingOn) {
  for (auto s : all_states())
    EXPECT_EQ(after(s, CellCommand::kAbort).has_value(), s != CellState::kAborting && s != CellState::kAborted)
        << to_string(s);
}

TEST(CellState, HoldIsTakenWhereverTheBeamMayComeOnWithoutAnotherWord) {
  for (auto s : {CellState::kStarting, CellState::kUnsuspending, CellState::kExecute, CellState::kHolding,
                 CellState::kHeld, CellState::kUnholding, CellState::kStopping})
    EXPECT_EQ(after(s, CellCommand::kHold), CellState::kHolding) << to_string(s);
  for (auto s : {CellState::kIdle, CellState::kSuspended, CellState::kComplete, CellState::kAborted})
    EXPECT_FALSE(after(s, CellCommand::kHold)) << to_string(s);
}

TEST(CellState, StartIsTakenOnlyWhenIdle) {
  for (auto s : all_states()) EXPECT_EQ(after(s, CellCommand::kStart).has_value(), s == CellState::kIdle);
}

}  // namespace
}  // namespace veneer::daemon
