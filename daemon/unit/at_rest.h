// Whether the unit rests: for whoever would end the program, watch the bed, or look at what was cut last. Pure.
#pragma once

#include "base/result.h"
#include "daemon/unit/cell_state.h"

namespace veneer::daemon {

// What goes on in the unit at one moment of the reactor.
struct Doings {
  CellState state = CellState::kStopped;
  bool activity = false;    // one is on
  bool jogging = false;     // one that no activity waits for has not told its end
  bool jog_coming = false;  // one is not on record yet
  bool on_record = false;   // something is, as under way
  bool reading = false;     // the controller reads strokes without moving
  bool committing = false;  // an activity waits for the disk
  bool end_owed = false;    // of a run that was broken off: it is not written yet
  bool beam_on = false;     // as the laser tells, like the next
  bool stands_still = true;
};

// kConflict while what was cut last is still to be booked.
Status check_booked(const Doings& now);
// kConflict, with a sentence, while anything moves, burns, runs or waits, or is still to be booked, and after an abort
// that nobody has cleared: what a program that ends now would break off or forget.
Status check_at_rest(const Doings& now);
// kConflict, with a sentence, while the unit looks at the bed again and again by itself, or is about to: no pictures
// for people who only watch then. A head that moves or burns is no reason: such a picture proves nothing, and gives
// way.
Status check_may_be_watched(CellState state);
// The beam is off, nothing is under way that moves the head, and what an abort proved is booked: an owed look may be
// taken (owed_proof.h).
bool allows_owed_look(const Doings& now);

}  // namespace veneer::daemon
