#include "daemon/unit/jogging.h"

#include <fmt/format.h>

#include <utility>

#include "base/clock.h"
#include "daemon/unit/consent.h"

namespace veneer::daemon {

namespace {

bool is_ready(CellState state) { return state == CellState::kIdle || state == CellState::kComplete; }
bool is_stopped(CellState state) { return state == CellState::kStopped || state == CellState::kAborted; }

}  // namespace

Status Jogging::may_jog(Millimetres dx, Millimetres dy) const {
  const CellState state = unit_.view.state;
  const LaserStatus laser = unit_.laser.status();
  const bool seeks_corner = laser.connected && !laser.homed && !unit_.limits.finds_home;
  if (!is_ready(state) && !(is_stopped(state) && seeks_corner))
    return Error{
        ErrorCode::kConflict,
        fmt::format(
            "the laser is jogged while the cell is Idle or Complete, now it is {}: bring it there first, by Reset "
            "where it is Stopped",
            to_string(state))};
  if (Status free = check_jog(unit_.keep_out, unit_.limits.travel, laser.position, dx, dy); laser.homed && !free)
    return free;
  return Ok();
}

void Jogging::jog(Millimetres dx, Millimetres dy, MmPerSecond speed, const std::string& who, Reply reply) {
  if (const Status may = may_jog(dx, dy); !may) return reply(may);
  unit_.audit.write({0, utc_timestamp(), who, "laser.jog", fmt::format("{:.3f} {:.3f} mm", dx.count(), dy.count())});
  unit_.head_moves();
  const auto go = [this, dx, dy, speed, stops = stops_, moment = unit_.activities.moment(),
                   openings = unit_.laser.status().lid_openings]() -> Status {
    if (!moment.is_current() || stops != stops_)
      return Error{ErrorCode::kCancelled, "the head was stopped before it moved"};
    if (Status may = may_jog(dx, dy); !may) return may;  // others may have come first
    if (Status may = check_lid_stayed(openings, unit_.laser.status()); !may) return may;
    unit_.head_moves();  // whoever looked meanwhile saw the head elsewhere
    return unit_.laser.jog(dx, dy, speed);
  };
  ++coming_;
  unit_.record.begin(WorkRecord::Work::kJog, "while the head was jogged",
                     [this, go, reply = std::move(reply), alive = std::weak_ptr<int>(alive_)](const Status& written) {
                       if (alive.expired()) return;
                       --coming_;
                       const Status taken = written ? go() : written;
                       if (taken) under_way_ = true;
                       note_end();
                       reply(taken);
                     });
}

Status Jogging::corner_is_here() {
  const CellState state = unit_.view.state;
  if (!is_ready(state) && !is_stopped(state))
    return Error{ErrorCode::kConflict,
                 fmt::format("the corner of the bed is told while the cell is at rest, now it is {}: wait until it is "
                             "Idle, Complete, Stopped or Aborted",
                             to_string(state))};
  return unit_.laser.corner_is_here();
}

void Jogging::stop() {
  ++stops_;
  unit_.laser.stop_jog();
}

void Jogging::stop_for_others() {
  under_way_ = true;
  unit_.laser.stop_jog();
}

void Jogging::ended() {
  under_way_ = false;
  note_end();
}

// One record stands for all of them.
void Jogging::note_end() {
  if (!under_way_ && coming_ == 0) unit_.record.end(WorkRecord::Work::kJog);
}

}  // namespace veneer::daemon
