// What an operator's word stands on. Pure.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// Whoever burns later than at once on a word that was given notes this when it is given, and asks in the turn of the
// reactor that burns.
struct Consent {
  int lid_openings = 0;     // LaserStatus::lid_openings
  std::int64_t states = 0;  // how often the unit went to another state
};

// kRefused once the lid was opened since: a word is given over a closed lid, and between it and what moves there is a
// write, which may take a while. `openings` is LaserStatus::lid_openings when it was given.
Status check_lid_stayed(int openings, const LaserStatus& laser);

// kRefused once the lid was opened since, or is open, or the unit went anywhere.
Status check_consent(const Consent& given, const Consent& now, const LaserStatus& laser);

}  // namespace veneer::daemon
