// What an operator turns while the laser runs: taken within the rules (override_rules.h) while something runs, and over
// when it is.
//
// Errors: of set(), what the laser says when it has none (kRefused); kConflict where nothing runs; kRefused beyond the
// rules, with the limit.
//
// Threading: bound to the reactor; nothing waits.
#pragma once

#include <functional>
#include <utility>

#include "base/result.h"
#include "daemon/unit/cell_view.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class Overrides {
 public:
  // Laser and view outlive this. `on_change` comes when set() has told the laser what was asked for.
  Overrides(LaserDriver& laser, const CellView& view, std::function<void()> on_change)
      : laser_(laser), view_(view), on_change_(std::move(on_change)) {}

  Status set(const LaserOverrides& wanted);
  // As they were asked for last: the machine may still be on its way there.
  LaserOverrides wanted() const { return laser_.status().overrides_wanted; }
  // The unit went to another state: where nothing runs any more they end.
  void state_entered();

 private:
  LaserDriver& laser_;
  const CellView& view_;
  std::function<void()> on_change_;
};

}  // namespace veneer::daemon
