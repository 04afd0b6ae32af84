// Whether the bed lies as an activity needs it: looked at with the head out of the picture, and proven until the lid is
// opened or RunnerOptions::look_every pieces are burnt.
//
// Bound to the reactor.
#pragma once

#include <functional>
#include <optional>

#include "base/geometry.h"
#include "base/log.h"
#include "base/result.h"
#include "daemon/unit/activity.h"

namespace veneer::daemon {

class BedProof {
 public:
  using Reply = std::function<void(const Status&)>;
  // `host` and `options` outlive this.
  BedProof(ActivityHost& host, const RunnerOptions& options, Logger log)
      : host_(host), options_(options), log_(std::move(log)) {}

  // Where the head stands after homing: out of the picture.
  void homed_at(const Point<MachineFrame>& place) { home_ = place; }

  // Looks as `activity` wants it, the head out of the picture where it may move (`free_to_move`), and answers unless
  // it is given up or the activity is over before.
  void begin(Activity& activity, bool free_to_move, Reply then);
  bool under_way() const { return proving_ != 0; }
  // Nothing is answered any more. True when the head is on its way out of the picture: its jog is to be stopped.
  bool give_up();
  // A jog has ended. True when it was the head's way out of the picture.
  bool jog_ended();

  // Since the bed was proven last.
  bool lid_was_opened() const;
  // Another look has to see what became of it: a picture from before, of a camera that is a file, proves nothing.
  void piece_burnt(const Activity& activity);
  bool is_due(const Activity& activity) const {
    return activity.proves_pose() && options_.look_every > 0 && pieces_since_ >= options_.look_every;
  }

 private:
  void look(Activity& activity, int proof, const Reply& then);
  bool park(const Activity& activity, std::function<void()> then);

  ActivityHost& host_;
  const RunnerOptions& options_;
  Logger log_;
  std::optional<Point<MachineFrame>> home_;
  int proofs_ = 0;                // begun
  int proving_ = 0;               // the one under way; 0 = none
  std::function<void()> parked_;  // while the head is on its way out of the picture
  int lid_at_proof_ = 0;          // LaserStatus::lid_openings when the bed was proven last
  int pieces_since_ = 0;
};

}  // namespace veneer::daemon
