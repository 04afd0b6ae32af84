// The unit's state after PackML (ISA-TR88.00.02), as docs/ARCHITECTURE.md narrows it.
//
// Pure: a table of which command leads where. What has to happen in an acting state (Resetting, Holding, ...), and
// where it leads when that is done, is the job runner's business.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::daemon {

enum class CellState {
  kStopped,
  kResetting,
  kIdle,
  kStarting,
  kExecute,
  kHolding,
  kHeld,
  kUnholding,
  kSuspending,
  kSuspended,
  kUnsuspending,
  kCompleting,
  kComplete,
  kStopping,
  kAborting,
  kAborted,
  kClearing,
};

enum class CellCommand { kReset, kStart, kHold, kUnhold, kUnsuspend, kStop, kAbort, kClear, kRecut };

std::string_view to_string(CellState state);      // "Suspended"
std::string_view to_string(CellCommand command);  // "unsuspend"
std::optional<CellCommand> command_from_string(std::string_view word);

// The acting state a command leads to, or nothing when it is not allowed there. Abort is allowed everywhere but in
// Aborting and Aborted; Hold wherever the beam may come on without another word; Suspended is left only by
// Unsuspend, Recut, Stop or Abort, and Aborted only by Clear. Recut is ours: an Unsuspend for a panel that was cut and
// still lies there; the unit comes back to where it was.
std::optional<CellState> after(CellState state, CellCommand command);

// kConflict: this command is not possible there, and what is, in words.
Error refusal(CellState state, CellCommand command);

}  // namespace veneer::daemon
