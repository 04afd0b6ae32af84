// The head sent by hand, dark, over a machine that is at rest: Idle or Complete. One that cannot find its corner itself
// and does not know it is sent in Stopped and Aborted too: no Reset goes on before the head stands in that corner.
//
// Where the corner is may be said in these four states only: strokes that are looked at, or burnt, were held against
// the travel and the zones from the corner that was.
//
// A jog is on record before the head moves (work_record.h), and the way to the disk takes its time: once it is there
// everything is asked again. A stop, an abort, an activity's end or an opened lid that came meanwhile calls the jog
// off; it never moves late. The way is held against travel and zones only of a laser that knows where it stands
// (check_jog in preflight.h).
//
// Errors: kConflict in another state, kRefused where the way is not free or the lid was opened, kCancelled when the jog
// was called off, kStorage when it could not be put on record.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "daemon/store/audit_log.h"
#include "daemon/unit/activity.h"
#include "daemon/unit/cell_view.h"
#include "daemon/unit/jog_commands.h"
#include "daemon/unit/preflight.h"
#include "daemon/unit/work_record.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class Jogging final : public JogCommands {
 public:
  // All of it outlives this.
  struct Unit {
    LaserDriver& laser;
    const LaserLimits& limits;  // of the laser that is connected
    const CellView& view;
    const std::vector<KeepOut>& keep_out;
    const Epoch& activities;  // what ends with them calls off what has not moved yet
    WorkRecord& record;
    AuditLog& audit;
    std::function<void()> head_moves;  // from here on what is seen of the bed may be the head
  };
  explicit Jogging(Unit unit) : unit_(std::move(unit)) {}

  void jog(Millimetres dx, Millimetres dy, MmPerSecond speed, const std::string& who, Reply reply) override;
  void stop() override;
  Status corner_is_here() override;

  // The laser has taken a jog that no activity waits for, and has not told its end.
  bool under_way() const { return under_way_; }
  // Asked for, and not on record yet.
  bool coming() const { return coming_ > 0; }
  // The head is on a way that somebody else began and does not wait for any more: it is stopped, and its end is still
  // to be told.
  void stop_for_others();
  // The laser tells that a jog has ended.
  void ended();
  // It never will: it was homed or reset. What is on record of it is the caller's.
  void forget() { under_way_ = false; }

 private:
  Status may_jog(Millimetres dx, Millimetres dy) const;
  void note_end();

  const Unit unit_;
  bool under_way_ = false;
  int coming_ = 0;
  int stops_ = 0;  // calls of stop(): a jog that is coming then does not go
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace veneer::daemon
