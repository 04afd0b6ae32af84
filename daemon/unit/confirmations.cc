#include "daemon/unit/confirmations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

namespace veneer::daemon {
namespace {

std::vector<std::string> without(const std::vector<std::string>& names, const std::vector<std::string>& others) {
  std::vector<std::string> out;
  std::ranges::copy_if(names, std::back_inserter(out),
                       [&](const std::string& name) { return std::ranges::count(others, name) == 0; });
  return out;
}

}  // namespace

Status check_confirmed(const std::vector<std::string>& wanted, const std::vector<std::string>& confirmed) {
  const std::vector<std::string> missing = without(wanted, confirmed);
  if (missing.empty()) return Ok();
  // What was said of the board was asked for by whoever looked at the bed.
  const std::vector<std::string> unknown = without(without(confirmed, wanted), {kBoardOnTheBed, kBoardNotSeen});
  // All is confirmed at once: what was given with a refused command is forgotten with it.
  return Error{ErrorCode::kRefused,
               fmt::format("nobody has confirmed yet what the beam needs ({}){}: see to it and confirm all of it, with "
                           "veneerctl by --confirm \"{}\"",
                           fmt::join(missing, ", "),
                           unknown.empty() ? "" : fmt::format(", and {} is not asked for", fmt::join(unknown, ", ")),
                           fmt::join(wanted, "\" --confirm \""))};
}

}  // namespace veneer::daemon
