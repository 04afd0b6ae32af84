#include "drivers/sane/scan_status.h"

#include <fmt/format.h>

namespace veneer::sane {

Error error_of(ScanStatus status, const std::string& scanner, std::string_view doing) {
  const auto say = [&](ErrorCode code, std::string_view what, std::string_view remedy) {
    return Error{code, fmt::format("the scanner {} {}, while {}: {}", scanner, what, doing, remedy)};
  };
  switch (status) {
    case ScanStatus::kUnsupported:
      return say(ErrorCode::kInvalidArgument, "cannot do that",
                 "see what it can do with veneerctl scanner list, and correct [scanner] of the configuration");
    case ScanStatus::kCancelled:
      return say(ErrorCode::kCancelled, "was told to stop", "scan again");
    case ScanStatus::kBusy:
      return say(ErrorCode::kUnavailable, "is busy", "close other programs that use it, then scan again");
    case ScanStatus::kInvalid:
      return say(ErrorCode::kUnavailable, "does not take its settings, or is not there",
                 "switch it on, and see veneerctl scanner list for its name and its settings");
    case ScanStatus::kEnd:
      return say(ErrorCode::kDeviceFault, "ended without a picture", "scan again");
    case ScanStatus::kJammed:
      return say(ErrorCode::kDeviceFault, "is jammed", "take out what is stuck in it, then scan again");
    case ScanStatus::kNoDocument:
      return say(ErrorCode::kDeviceFault, "finds nothing to scan",
                 "lay the panel on its glass, and set source under [scanner] to the flatbed");
    case ScanStatus::kCoverOpen:
      return say(ErrorCode::kDeviceFault, "has its cover open", "close it, then scan again");
    case ScanStatus::kIoError:
      return say(ErrorCode::kDeviceFault, "could not be read or written",
                 "look at its cable or network and its power, then scan again");
    case ScanStatus::kNoMemory:
      return say(ErrorCode::kUnavailable, "ran out of memory",
                 "scan a smaller area or at a lower resolution, or raise memory_mb in [workers]");
    case ScanStatus::kAccessDenied:
      return say(ErrorCode::kUnavailable, "may not be used by the daemon",
                 "put the drop-in for USB scanners in place, or add the daemon's user to the group scanner");
    case ScanStatus::kWarmingUp:
      return say(ErrorCode::kUnavailable, "is still warming up its lamp", "wait a few minutes, then scan again");
    case ScanStatus::kLocked:
      return say(ErrorCode::kDeviceFault, "is locked for transport", "open its lock, then scan again");
    case ScanStatus::kGood:
    case ScanStatus::kUnknown:
      break;
  }
  return say(ErrorCode::kDeviceFault, "gave an answer that SANE does not know",
             "switch it off and on, then scan again");
}

}  // namespace veneer::sane
