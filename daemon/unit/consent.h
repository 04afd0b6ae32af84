// What an operator's word stands on. Pure.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// Who does not burn at once on an operator's word notes this when the word is given, and compares it (check_consent)
// in the same turn of the reactor that starts the burn.
struct Consent {
  int lid_openings = 0;     // LaserStatus::lid_openings
  std::int64_t states = 0;  // how often the unit went to another state
};

// kRefused once the lid was opened since the word was given: it is given with the lid closed, and what moves waits for
// a write to the database first. `openings` is LaserStatus::lid_openings when it was given.
Status check_lid_stayed(int openings, const LaserStatus& laser);

// kRefused once the lid was opened since, or is open, or the unit went anywhere.
Status check_consent(const Consent& given, const Consent& now, const LaserStatus& laser);

}  // namespace veneer::daemon
