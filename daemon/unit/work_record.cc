#include "daemon/unit/work_record.h"

#include <utility>

#include "base/clock.h"

namespace veneer::daemon {

void WorkRecord::begin(Work work, const std::string& doing, Reply written) {
  under_way_.push_back({work, doing});
  database_->async(
      [doing, number = ++last_, forgotten = forgotten_, newest = written_](Repositories& r) -> Status {
        if (*newest < forgotten)
          return Error{ErrorCode::kStorage,
                       "that the work before was broken off is not written yet: make room on the disk, and try again"};
        Status noted = r.jobs.note_under_way(doing, utc_timestamp());
        if (noted) *newest = number;
        return noted;
      },
      std::move(written));
}

void WorkRecord::end(Work work) {
  if (std::erase_if(under_way_, [work](const UnderWay& one) { return one.work == work; }) > 0) write_newest();
}

void WorkRecord::end_all() {
  if (under_way_.empty()) return;
  under_way_.clear();
  write_newest();
}

void WorkRecord::forget() {
  under_way_.clear();
  forgotten_ = ++last_;
  database_->owe([number = last_, newest = written_](Repositories&) {
    *newest = number;
    return Ok();
  });
}

void WorkRecord::write_newest() {
  database_->owe([doing = under_way_.empty() ? std::string() : under_way_.back().doing, number = ++last_,
                  newest = written_](Repositories& r) {
    if (*newest > number) return Ok();
    Status noted = doing.empty() ? r.jobs.note_at_rest(utc_timestamp()) : r.jobs.note_under_way(doing, utc_timestamp());
    if (noted) *newest = number;
    return noted;
  });
}

}  // namespace veneer::daemon
