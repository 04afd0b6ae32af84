#include "daemon/services/alarm_book.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace veneer::daemon {
namespace {

bool holds(const Alarm& alarm) { return alarm.until.empty(); }
bool is_seen(const Alarm& alarm) { return !alarm.seen_by.empty(); }

AlarmState state_of(const Alarm& alarm) {
  if (holds(alarm)) return is_seen(alarm) ? AlarmState::kAcknowledged : AlarmState::kNew;
  return is_seen(alarm) ? AlarmState::kOver : AlarmState::kReturned;
}

}  // namespace

std::string_view to_string(AlarmState state) {
  switch (state) {
    case AlarmState::kNew:
      return "new";
    case AlarmState::kAcknowledged:
      return "acknowledged";
    case AlarmState::kReturned:
      return "returned";
    case AlarmState::kOver:
      return "over";
  }
  return "over";
}

Alarm& AlarmBook::add(AlarmCondition what, const std::string& now) {
  if (alarms_.size() >= kKept) {
    const auto over = std::ranges::find(alarms_, AlarmState::kOver, &Alarm::state);
    const auto gone = over != alarms_.end() ? over : std::ranges::find_if_not(alarms_, holds);
    if (gone != alarms_.end()) alarms_.erase(gone);
  }
  alarms_.push_back({++last_id_, std::move(what), AlarmState::kNew, now, "", "", ""});
  return alarms_.back();
}

AlarmBook::Changes AlarmBook::take(const std::vector<AlarmCondition>& conditions, const std::string& now) {
  Changes changes;
  for (Alarm& alarm : alarms_) {
    if (!holds(alarm)) continue;
    const auto still = std::ranges::find(conditions, alarm.what.key, &AlarmCondition::key);
    if (still != conditions.end()) {
      alarm.what = *still;
      continue;
    }
    alarm.until = now;
    alarm.state = state_of(alarm);
    changes.ended.push_back(alarm);
  }
  for (const AlarmCondition& condition : conditions) {
    const bool known = std::ranges::any_of(
        alarms_, [&](const Alarm& alarm) { return holds(alarm) && alarm.what.key == condition.key; });
    if (!known) changes.begun.push_back(add(condition, now));
  }
  return changes;
}

Alarm AlarmBook::happened(AlarmCondition what, const std::string& now) {
  Alarm& alarm = add(std::move(what), now);
  alarm.until = now;
  alarm.state = state_of(alarm);
  return alarm;
}

Status AlarmBook::acknowledge(std::int64_t id, const std::string& who, const std::string& now) {
  const auto found = std::ranges::find(alarms_, id, &Alarm::id);
  if (found == alarms_.end()) return Error{ErrorCode::kNotFound, fmt::format("there is no alarm {}", id)};
  if (is_seen(*found))
    return Error{ErrorCode::kConflict, fmt::format("alarm {} was acknowledged by {} already", id, found->seen_by)};
  found->seen_by = who;
  found->seen_at = now;
  found->state = state_of(*found);
  return Ok();
}

int AlarmBook::acknowledge_all(const std::string& who, const std::string& now) {
  int seen = 0;
  for (const Alarm& alarm : alarms_)
    if (acknowledge(alarm.id, who, now)) ++seen;
  return seen;
}

int AlarmBook::count(AlarmState state) const {
  return static_cast<int>(std::ranges::count(alarms_, state, &Alarm::state));
}

}  // namespace veneer::daemon
