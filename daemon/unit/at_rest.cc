#include "daemon/unit/at_rest.h"

#include <fmt/format.h>

#include <string>

namespace veneer::daemon {
namespace {

Error not_now(const std::string& why) { return {ErrorCode::kConflict, why}; }

}  // namespace

Status check_booked(const Doings& now) {
  if (!now.end_owed && !now.committing) return Ok();
  return not_now("what was cut last is still to be booked: wait, or make room on the disk and Clear");
}

Status check_at_rest(const Doings& now) {
  if (Status booked = check_booked(now); !booked) return booked;
  switch (now.state) {
    case CellState::kStopped:
    case CellState::kIdle:
    case CellState::kComplete:
      break;
    case CellState::kAborted:
      return not_now("the cell is Aborted: look at why, then Clear it");
    default:
      return not_now(fmt::format("the cell is {}: let it end, or Stop it", to_string(now.state)));
  }
  if (now.activity || now.beam_on) return not_now("the laser is at work: let it end, or Stop it");
  if (now.jogging || now.on_record || !now.stands_still) return not_now("the head moves: wait until it stands still");
  if (now.reading) return not_now("the laser's controller reads strokes just now: wait until it has");
  return Ok();
}

Status check_may_be_watched(CellState state) {
  switch (state) {
    case CellState::kStarting:
    case CellState::kSuspending:
    case CellState::kSuspended:
    case CellState::kUnsuspending:
      return not_now("the cell waits for a panel and looks at the bed by itself: its last look is GET /bed.jpg");
    default:
      return Ok();
  }
}

bool allows_owed_look(const Doings& now) {
  const bool rests = now.state == CellState::kAborted || now.state == CellState::kStopped ||
                     now.state == CellState::kIdle || now.state == CellState::kSuspended ||
                     now.state == CellState::kComplete;
  return rests && !now.activity && !now.jogging && !now.jog_coming && !now.end_owed && !now.beam_on;
}

}  // namespace veneer::daemon
