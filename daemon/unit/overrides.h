// What an operator turns while the laser runs: taken within the rules (override_rules.h) while something runs, and over
// when it is.
//
// Threading: bound to the reactor; nothing waits.
#pragma once

#include <functional>
#include <utility>

#include "base/result.h"
#include "daemon/unit/cell_view.h"
#include "daemon/unit/override_commands.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class Overrides final : public OverrideCommands {
 public:
  // Laser and view outlive this. `on_change` comes when set() has told the laser what was asked for.
  Overrides(LaserDriver& laser, const CellView& view, std::function<void()> on_change)
      : laser_(laser), view_(view), on_change_(std::move(on_change)) {}

  Status set(const LaserOverrides& wanted) override;
  LaserOverrides wanted() const override { return laser_.status().overrides_wanted; }
  // The unit went to another state: where nothing runs any more they end.
  void state_entered();

 private:
  LaserDriver& laser_;
  const CellView& view_;
  std::function<void()> on_change_;
};

}  // namespace veneer::daemon
