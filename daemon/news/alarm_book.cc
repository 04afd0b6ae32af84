#include "daemon/news/alarm_book.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/utf8.h"

namespace veneer::daemon {
namespace {

bool holds(const Alarm& alarm) { return alarm.until.empty(); }
bool is_seen(const Alarm& alarm) { return !alarm.seen_by.empty(); }

AlarmState state_of(const Alarm& alarm) {
  if (holds(alarm)) return is_seen(alarm) ? AlarmState::kAcknowledged : AlarmState::kNew;
  return is_seen(alarm) ? AlarmState::kOver : AlarmState::kReturned;
}

bool is_worse(const AlarmCondition& now, const AlarmCondition& before) {
  return (now.urgent && !before.urgent) || now.count > before.count;
}

// The most dispensable has the least; what holds is not asked for.
int worth_of(const Alarm& alarm) {
  return (alarm.state == AlarmState::kOver ? 0 : 3) + (alarm.what.urgent ? 2 : alarm.lasting ? 1 : 0);
}

AlarmCondition shortened(AlarmCondition what) {
  constexpr std::string_view kMore = "...";
  std::string& text = what.sentence;
  if (text.size() <= AlarmBook::kLongestSentence) return what;
  text.resize(beginning_of(text, AlarmBook::kLongestSentence - kMore.size()).size());
  text += kMore;
  return what;
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

AlarmBook::AlarmBook(std::int64_t last_id, std::deque<Alarm> alarms) : last_id_(last_id), alarms_(std::move(alarms)) {
  for (Alarm& alarm : alarms_) {
    last_id_ = std::max(last_id_, alarm.id);
    alarm.state = state_of(alarm);
  }
}

Alarm& AlarmBook::add(AlarmCondition what, const std::string& now) {
  if (alarms_.size() >= kKept) {
    auto gone = alarms_.end();
    for (auto alarm = alarms_.begin(); alarm != alarms_.end(); ++alarm)
      if (!holds(*alarm) && (gone == alarms_.end() || worth_of(*alarm) < worth_of(*gone))) gone = alarm;
    if (gone != alarms_.end()) alarms_.erase(gone);
  }
  alarms_.push_back({++last_id_, shortened(std::move(what)), AlarmState::kNew, true, now, "", "", ""});
  return alarms_.back();
}

AlarmBook::Changes AlarmBook::take(const std::vector<AlarmCondition>& conditions, const std::string& now) {
  Changes changes;
  std::vector<std::int64_t> outdone;
  for (Alarm& alarm : alarms_) {
    if (!holds(alarm)) continue;
    const auto still = std::ranges::find(conditions, alarm.what.key, &AlarmCondition::key);
    const bool is_there = still != conditions.end();
    if (is_there && !is_worse(*still, alarm.what)) {
      changes.eased = changes.eased || is_worse(alarm.what, *still);
      alarm.what = shortened(*still);
      continue;
    }
    alarm.until = now;
    alarm.state = state_of(alarm);
    changes.ended.push_back(alarm);
    // The worse one says all that is to be seen of it.
    if (is_there && !is_seen(alarm)) outdone.push_back(alarm.id);
  }
  std::erase_if(alarms_, [&](const Alarm& alarm) { return std::ranges::find(outdone, alarm.id) != outdone.end(); });
  for (const AlarmCondition& condition : conditions) {
    const bool known = std::ranges::any_of(
        alarms_, [&](const Alarm& alarm) { return holds(alarm) && alarm.what.key == condition.key; });
    if (!known) changes.begun.push_back(add(condition, now));
  }
  return changes;
}

Alarm AlarmBook::happened(AlarmCondition what, const std::string& now) {
  Alarm& alarm = add(std::move(what), now);
  alarm.lasting = false;
  alarm.until = now;
  alarm.state = state_of(alarm);
  return alarm;
}

Status AlarmBook::acknowledge(std::int64_t id, const std::string& who, const std::string& now) {
  const auto found = std::ranges::find(alarms_, id, &Alarm::id);
  if (found == alarms_.end())
    return Error{ErrorCode::kNotFound, fmt::format("there is no alarm {}: see `veneerctl alarm list`", id)};
  if (is_seen(*found))
    return Error{ErrorCode::kConflict, fmt::format("alarm {} was acknowledged by {} already", id, found->seen_by)};
  found->seen_by = who;
  found->seen_at = now;
  found->state = state_of(*found);
  return Ok();
}

int AlarmBook::acknowledge_all(const std::string& who, const std::string& now, std::int64_t up_to) {
  int seen = 0;
  for (const Alarm& alarm : alarms_)
    if (alarm.id <= up_to && acknowledge(alarm.id, who, now)) ++seen;
  return seen;
}

int AlarmBook::count(AlarmState state) const {
  return static_cast<int>(std::ranges::count(alarms_, state, &Alarm::state));
}

}  // namespace veneer::daemon
