// Whether the data's disk has room for what a run books.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "base/clock.h"
#include "base/result.h"

namespace veneer::daemon {

// How it is where there is none, as the chain of interlocks says it, too.
inline constexpr const char* kDiskIsNearlyFull = "the disk is nearly full, and soon no cut can be booked";

// Bytes: some scans of large panels, and a backup of them.
inline constexpr std::uintmax_t kLittleRoom = 2'000'000'000;

// kRefused where less is free than the database takes at once for a run. A disk that has not said refuses nothing: what
// cannot be booked ends its job all the same. Pure; thread-safe.
Status check_room(const std::optional<std::uintmax_t>& free_bytes);

// What the disk said last. One that hangs says nothing more, and what it said before is no reason to refuse for good.
// Bound to the reactor.
class DiskRoom {
 public:
  static constexpr std::chrono::minutes kBelieved{3};

  explicit DiskRoom(const Clock& clock) : clock_(clock) {}
  // Nothing: it was asked and could not say.
  void told(std::optional<std::uintmax_t> free_bytes);
  // Nothing while it has not said, or not for longer than kBelieved.
  std::optional<std::uintmax_t> free_bytes() const;

 private:
  const Clock& clock_;
  std::optional<std::uintmax_t> free_bytes_;
  TimePoint told_;
};

}  // namespace veneer::daemon
