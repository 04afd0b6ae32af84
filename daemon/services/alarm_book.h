// What needs somebody, from when to when, and who has seen it: new until it is acknowledged; returned when it went by
// itself before anybody saw it, and kept in sight until somebody has; over once it is both gone and seen. Pure.
//
// It is of this life of the daemon: what still holds after a restart is new again. The audit log keeps all of it.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

enum class AlarmState { kNew, kAcknowledged, kReturned, kOver };
std::string_view to_string(AlarmState state);

struct AlarmCondition {
  std::string key;  // what it is about: "aborted", "certificate scanner"; one at a time has it
  bool urgent = false;
  std::string sentence;  // for a person
};

struct Alarm {
  std::int64_t id = 0;
  AlarmCondition what;
  AlarmState state = AlarmState::kNew;
  std::string since, until;      // UTC; `until` "" while it holds
  std::string seen_by, seen_at;  // "" until it is acknowledged
};

class AlarmBook {
 public:
  static constexpr std::size_t kKept = 500;  // the oldest that are over go first

  struct Changes {
    std::vector<Alarm> begun, ended;
    bool any() const { return !begun.empty() || !ended.empty(); }
  };
  // All that holds at `now`. What was told of before is the same alarm while its key is there; its sentence may change.
  Changes take(const std::vector<AlarmCondition>& conditions, const std::string& now);
  // Something that happened and does not last: returned from the beginning.
  Alarm happened(AlarmCondition what, const std::string& now);
  // kNotFound; kConflict when somebody has, saying who.
  Status acknowledge(std::int64_t id, const std::string& who, const std::string& now);
  // How many were not yet.
  int acknowledge_all(const std::string& who, const std::string& now);

  const std::deque<Alarm>& alarms() const { return alarms_; }  // oldest first
  int count(AlarmState state) const;

 private:
  Alarm& add(AlarmCondition what, const std::string& now);

  std::int64_t last_id_ = 0;
  std::deque<Alarm> alarms_;
};

}  // namespace veneer::daemon
