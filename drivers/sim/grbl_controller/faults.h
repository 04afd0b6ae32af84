// What can go wrong on a GRBL machine and its wire, one option each. A fault is set, waits for its moment, happens
// once.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"

namespace veneer::sim {

enum class FaultKind {
  kDropOk,       // the after-th ok from now is not sent
  kDuplicateOk,  // ... is sent twice
  kGarbleByte,   // the after-th received byte from now arrives as another printable character (drawn from the seed)
  kDropByte,     // the after-th received byte from now never arrives
  kFuseLines,    // the after-th newline from now never arrives, so two lines become one
  kStall,        // at the after-th line from now the firmware hangs: no motion, no answer, beam dark
  kUnplug,       // at the after-th received byte from now the link is gone; the controller itself goes on
  kBanner,       // at the after-th line from now the controller resets by itself (brown-out: position lost)
  kError,        // the after-th line from now is answered with error:value and not executed
  kAlarm,        // at the after-th line from now ALARM:value is raised in whatever the machine does
  kSlip,         // at the after-th line from now the head loses value micrometres in +x without noticing
};

struct Fault {
  FaultKind kind;
  std::uint64_t after = 1;  // 1 = the next one
  int value = 0;
};

// "drop_ok", "duplicate_ok", "garble_byte", "drop_byte", "fuse_lines", "stall", "unplug", "banner", "error", "alarm",
// "slip". kNotFound names them all.
Result<FaultKind> fault_kind(std::string_view name);

}  // namespace veneer::sim
