// What needs somebody, from when to when, and who has seen it: new until it is acknowledged; returned when it went by
// itself before anybody saw it, and kept in sight until somebody has; over once it is both gone and seen. Pure.
//
// It outlives the daemon (kept_alarms.h): what still holds after a restart is the same alarm, seen by whom it was.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
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
  std::string sentence;  // for a person; of a long one the book keeps the beginning
  int count = 1;         // of how many things
};

struct Alarm {
  std::int64_t id = 0;
  AlarmCondition what;
  AlarmState state = AlarmState::kNew;
  bool lasting = true;           // false: it happened, and was over at once
  std::string since, until;      // UTC; `until` "" while it holds
  std::string seen_by, seen_at;  // "" until it is acknowledged
};

class AlarmBook {
 public:
  // Of more, those that are over go first, then those that do not last, urgent ones last; of alike ones the oldest.
  // What holds stays.
  static constexpr std::size_t kKept = 500;
  static constexpr std::size_t kLongestSentence = 300;  // in bytes; never within a character

  AlarmBook() = default;
  // As another one was left, oldest first.
  AlarmBook(std::int64_t last_id, std::deque<Alarm> alarms);

  struct Changes {
    std::vector<Alarm> begun, ended;
    bool eased = false;  // one that goes on is of fewer things, or no longer urgent
    bool any() const { return !begun.empty() || !ended.empty(); }
  };
  // All that holds at `now`. What was told of before is the same alarm while its key is there; its sentence may change.
  // One that got worse (urgent, or of more things) is another, with a number of its own: nobody has seen that yet.
  Changes take(const std::vector<AlarmCondition>& conditions, const std::string& now);
  // Something that happened and does not last: returned from the beginning.
  Alarm happened(AlarmCondition what, const std::string& now);
  // kNotFound; kConflict when somebody has, saying who.
  Status acknowledge(std::int64_t id, const std::string& who, const std::string& now);
  // All with numbers up to `up_to`. How many were not yet.
  int acknowledge_all(const std::string& who, const std::string& now,
                      std::int64_t up_to = std::numeric_limits<std::int64_t>::max());

  const std::deque<Alarm>& alarms() const { return alarms_; }  // oldest first
  std::int64_t last_id() const { return last_id_; }
  int count(AlarmState state) const;

 private:
  Alarm& add(AlarmCondition what, const std::string& now);

  std::int64_t last_id_ = 0;
  std::deque<Alarm> alarms_;
};

}  // namespace veneer::daemon
