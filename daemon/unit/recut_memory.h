// Keeps which cuts the laser can follow once more (kept_cuts.h): reads them from the database after a restart, shows
// them in the view, and forgets them in both.
//
// Bound to the reactor.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/cell_view.h"
#include "daemon/unit/kept_cuts.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class RecutMemory {
 public:
  // `laser`: the limits of the one that is connected, or nullptr. `on_change` comes when the database remembered some.
  // Database and view outlive this.
  RecutMemory(DatabaseThread& database, CellView& view, Logger log, std::function<const LaserLimits*()> laser,
              std::function<void()> on_change)
      : database_(database),
        view_(view),
        log_(std::move(log)),
        laser_(std::move(laser)),
        on_change_(std::move(on_change)) {}

  // What runs keep, and what a recut stands on.
  KeptCuts& cuts() { return cuts_; }
  // These, by their marks. kConflict when nothing can be cut again, kNotFound for another piece, kInvalidArgument for
  // none.
  Result<std::vector<PieceBurn>> find(const std::vector<std::string>& marks) const;

  // As a run before this program's start left them. Once, before any run begins: the database is asked in order.
  void recall();
  // Another laser's positions are not those of the run: nothing can be cut again with it.
  void laser_connected();
  // What a run has kept since stands in the view: all of it, or how many.
  void show();
  void count() { view_.can_recut = cuts_.count(); }
  // This program does not cut them again. On disk they are forgotten as soon as it takes that; until then a restart
  // may recall them, and the proof of the pose before a recut stands in the way.
  void forget();

 private:
  bool another_laser() const;

  DatabaseThread& database_;
  CellView& view_;
  Logger log_;
  std::function<const LaserLimits*()> laser_;
  std::function<void()> on_change_;
  KeptCuts cuts_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace veneer::daemon
