#include "daemon/unit/bed_proof.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/unit/preflight.h"

namespace veneer::daemon {

void BedProof::begin(Activity& activity, bool free_to_move, Reply then) {
  const int proof = proving_ = ++proofs_;
  const auto look_now = [this, &activity, proof, then = std::move(then)] {
    if (proving_ == proof) look(activity, proof, then);
  };
  if (!free_to_move || !park(activity, look_now)) look_now();
}

void BedProof::look(Activity& activity, int proof, const Reply& then) {
  const LaserStatus laser = host_.parts().laser.status();
  if (const Status closed = check_lid(laser); !closed) {  // hands may be in until it is, which nobody counts
    proving_ = 0;
    return then(closed);
  }
  // Counted before the picture is taken: a lid that opens later spoils it.
  const int openings = laser.lid_openings;
  const auto seen = [this, proof, openings, proves_pose = activity.proves_pose(), then](const Status& as_it_must_be) {
    if (proving_ != proof) return;
    proving_ = 0;
    if (!as_it_must_be) return then(as_it_must_be);
    lid_at_proof_ = openings;
    pieces_since_ = 0;
    // The next look has to see what becomes of it from now on; a camera that is a file may show this again.
    if (proves_pose) host_.parts().bed.hands_were_in();
    if (lid_was_opened())
      return then(Error{ErrorCode::kRefused, "the lid was opened while the camera looked: close it and try again"});
    then(Ok());
  };
  if (!activity.needs_look()) return seen(Ok());
  activity.look(host_.while_current(seen));
}

bool BedProof::give_up() {
  proving_ = 0;
  return std::exchange(parked_, nullptr) != nullptr;
}

bool BedProof::jog_ended() {
  if (!parked_) return false;
  std::exchange(parked_, nullptr)();
  return true;
}

void BedProof::piece_burnt(const Activity& activity) {
  ++pieces_since_;
  if (activity.proves_pose()) host_.parts().bed.was_cut();
}

bool BedProof::lid_was_opened() const { return host_.parts().laser.status().lid_openings != lid_at_proof_; }

// Sends the head back to where it stood after homing, if the machine can and the way there and on is free. False when
// it stays.
bool BedProof::park(const Activity& activity, std::function<void()> then) {
  if (!activity.proves_pose() || !home_) return false;
  const LaserStatus laser = host_.parts().laser.status();
  const Millimetres dx = home_->x - laser.position.x, dy = home_->y - laser.position.y;
  if (std::max(std::abs(dx.count()), std::abs(dy.count())) < 1) return false;
  const auto on = activity.next_start();
  const DarkWays ways = host_.limits().dark_ways;
  const auto free = [&](const Point<MachineFrame>& a, const Point<MachineFrame>& b) {
    return zone_on_way(options_.keep_out, ways, a, b) == nullptr;
  };
  if (!free(laser.position, *home_) || (on && !free(*home_, *on))) return false;
  MmPerSecond speed = options_.frame_speed;
  if (const MmPerSecond fastest = host_.limits().fastest; fastest > MmPerSecond(0)) speed = std::min(speed, fastest);
  if (const Status moves = host_.parts().laser.jog(dx, dy, speed); !moves) {
    log_->debug("the head stays in the picture: {}", moves.error().message);
    return false;
  }
  parked_ = std::move(then);
  return true;
}

}  // namespace veneer::daemon
