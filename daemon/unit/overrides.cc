#include "daemon/unit/overrides.h"

#include <fmt/format.h>

#include "daemon/unit/override_rules.h"

namespace veneer::daemon {

Status Overrides::set(const LaserOverrides& wanted) {
  if (!overrides_belong_to(view_.state)) {
    // A laser that has none says so, whatever the cell does; to any other this is what it has already.
    if (Status none = laser_.set_overrides({}); !none) return none;
    return Error{
        ErrorCode::kConflict,
        fmt::format("the cell is {}, but overrides are for what runs and end with it: wait until something does",
                    to_string(view_.state))};
  }
  if (Status allowed = check_overrides(wanted, view_.job || view_.recutting); !allowed) return allowed;
  Status taken = laser_.set_overrides(wanted);
  on_change_();
  return taken;
}

void Overrides::state_entered() {
  if (overrides_belong_to(view_.state) || wanted() == LaserOverrides{}) return;
  static_cast<void>(laser_.set_overrides({}));  // a laser that is being reset forgets them itself
}

}  // namespace veneer::daemon
