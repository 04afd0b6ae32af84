#include "daemon/unit/consent.h"

#include <fmt/format.h>

#include "daemon/unit/preflight.h"

namespace veneer::daemon {

Status check_lid_stayed(int openings, const LaserStatus& laser) {
  if (laser.lid_openings == openings) return Ok();
  return Error{ErrorCode::kRefused,
               "the lid was opened since this was asked for: look at what lies on the bed, close it, and ask for it "
               "again"};
}

Status check_consent(const Consent& given, const Consent& now, const LaserStatus& laser) {
  const Status lid = check_lid(laser);
  const std::string meanwhile =
      now.lid_openings != given.lid_openings
          ? "the lid was opened since this was asked for: look at what lies on the bed, close it"
      : !lid ? lid.error().message
      : now.states != given.states
          ? "the cell went on to something else since this was asked for: see that the bed is as it must be"
          : "";
  if (meanwhile.empty()) return Ok();
  return Error{ErrorCode::kRefused, fmt::format("{}, and ask for it again; nothing was burnt", meanwhile)};
}

}  // namespace veneer::daemon
