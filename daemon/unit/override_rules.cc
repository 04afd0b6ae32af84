#include "daemon/unit/override_rules.h"

#include <fmt/format.h>

namespace veneer::daemon {

bool overrides_belong_to(CellState state) {
  switch (state) {
    case CellState::kExecute:
    case CellState::kHolding:
    case CellState::kHeld:
    case CellState::kUnholding:
    case CellState::kSuspending:
    case CellState::kSuspended:
    case CellState::kUnsuspending:
    case CellState::kStopping:
      return true;
    default:
      return false;
  }
}

Status check_overrides(const LaserOverrides& wanted, bool booked) {
  if (wanted.power > 100)
    return Error{ErrorCode::kRefused,
                 fmt::format("the power stays at or below what the recipe says, {} % would be above it: change the "
                             "recipe, or take a slower feed",
                             wanted.power)};
  if (wanted.feed > 100 && wanted.feed * wanted.power > 100 * 100)
    return Error{
        ErrorCode::kRefused,
        fmt::format(
            "the beam's power rises with the speed, so at a feed of {} % and a power of {} % the tube would burn "
            "with {} % of what the recipe says: the power is at most {} % then, or the feed at most {} %",
            wanted.feed, wanted.power, wanted.feed * wanted.power / 100, 100 * 100 / wanted.feed,
            100 * 100 / wanted.power)};
  if (booked && wanted.feed < wanted.power)
    return Error{
        ErrorCode::kRefused,
        fmt::format("a feed of {} % at a power of {} % would burn wider than the kerf that is booked: the feed "
                    "is at least {} % then, or the power at most {} %",
                    wanted.feed, wanted.power, wanted.power, wanted.feed)};
  return Ok();
}

}  // namespace veneer::daemon
