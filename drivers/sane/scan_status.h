// What a scanner says of itself, in words. Pure.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::sane {

// As SANE numbers them; what is none of these is kUnknown.
enum class ScanStatus {
  kGood,
  kUnsupported,
  kCancelled,
  kBusy,
  kInvalid,
  kEnd,  // of the data
  kJammed,
  kNoDocument,
  kCoverOpen,
  kIoError,
  kNoMemory,
  kAccessDenied,
  kWarmingUp,  // the lamp is not ready: try again
  kLocked,     // for transport
  kUnknown,
};

// One sentence for the operator; `doing` is what failed, as in "opening". REQUIRES: status is not kGood.
Error error_of(ScanStatus status, const std::string& scanner, std::string_view doing);

}  // namespace veneer::sane
