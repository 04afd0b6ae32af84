#include "daemon/unit/cell_state.h"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace veneer::daemon {
namespace {

using S = CellState;
using C = CellCommand;

constexpr std::array<std::pair<C, std::string_view>, 9> kCommands{{{C::kReset, "reset"},
                                                                   {C::kStart, "start"},
                                                                   {C::kHold, "hold"},
                                                                   {C::kUnhold, "unhold"},
                                                                   {C::kUnsuspend, "unsuspend"},
                                                                   {C::kStop, "stop"},
                                                                   {C::kAbort, "abort"},
                                                                   {C::kClear, "clear"},
                                                                   {C::kRecut, "recut"}}};

// Wherever the beam may come on without another word.
bool holdable(S state) {
  switch (state) {
    case S::kStarting:
    case S::kUnsuspending:
    case S::kExecute:
    case S::kHolding:
    case S::kHeld:
    case S::kUnholding:
    case S::kStopping:
      return true;
    default:
      return false;
  }
}

bool stoppable(S state) {
  switch (state) {
    case S::kStopped:
    case S::kStopping:
    case S::kAborting:
    case S::kAborted:
    case S::kClearing:
      return false;
    default:
      return true;
  }
}

}  // namespace

std::string_view to_string(CellState state) {
  switch (state) {
    case S::kStopped:
      return "Stopped";
    case S::kResetting:
      return "Resetting";
    case S::kIdle:
      return "Idle";
    case S::kStarting:
      return "Starting";
    case S::kExecute:
      return "Execute";
    case S::kHolding:
      return "Holding";
    case S::kHeld:
      return "Held";
    case S::kUnholding:
      return "Unholding";
    case S::kSuspending:
      return "Suspending";
    case S::kSuspended:
      return "Suspended";
    case S::kUnsuspending:
      return "Unsuspending";
    case S::kCompleting:
      return "Completing";
    case S::kComplete:
      return "Complete";
    case S::kStopping:
      return "Stopping";
    case S::kAborting:
      return "Aborting";
    case S::kAborted:
      return "Aborted";
    case S::kClearing:
      return "Clearing";
  }
  return "Aborted";
}

std::string_view to_string(CellCommand command) {
  for (const auto& [c, word] : kCommands)
    if (c == command) return word;
  return "";
}

std::optional<CellCommand> command_from_string(std::string_view word) {
  for (const auto& [c, w] : kCommands)
    if (w == word) return c;
  return std::nullopt;
}

std::optional<CellState> after(CellState state, CellCommand command) {
  switch (command) {
    case C::kReset:
      return state == S::kStopped || state == S::kComplete ? std::optional(S::kResetting) : std::nullopt;
    case C::kStart:
      return state == S::kIdle ? std::optional(S::kStarting) : std::nullopt;
    case C::kHold:
      return holdable(state) ? std::optional(S::kHolding) : std::nullopt;
    case C::kUnhold:
      return state == S::kHeld ? std::optional(S::kUnholding) : std::nullopt;
    case C::kUnsuspend:
      return state == S::kSuspended ? std::optional(S::kUnsuspending) : std::nullopt;
    case C::kStop:
      return stoppable(state) ? std::optional(S::kStopping) : std::nullopt;
    case C::kAbort:
      return state == S::kAborting || state == S::kAborted ? std::nullopt : std::optional(S::kAborting);
    case C::kClear:
      return state == S::kAborted ? std::optional(S::kClearing) : std::nullopt;
    case C::kRecut:
      return state == S::kSuspended || state == S::kComplete || state == S::kStopped || state == S::kIdle
                 ? std::optional(S::kUnsuspending)
                 : std::nullopt;
  }
  return std::nullopt;
}

Error refusal(CellState state, CellCommand command) {
  const char* instead = "";
  if (state == S::kAborted) instead = ": Clear it first, then Reset";
  if (state == S::kStopped || state == S::kComplete) instead = ": Reset it first";
  if (state == S::kHeld) instead = ": Unhold, Stop or Abort";
  if (state == S::kSuspended) instead = ": Unsuspend, Stop or Abort";
  return {ErrorCode::kConflict,
          fmt::format("{} is not possible while the cell is {}{}", to_string(command), to_string(state), instead)};
}

}  // namespace veneer::daemon
