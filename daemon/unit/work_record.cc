#include "daemon/unit/work_record.h"

#include <utility>

#include "base/clock.h"

namespace veneer::daemon {

void WorkRecord::begin(Work work, const std::string& doing, Reply written) {
  under_way_.push_back({work, doing});
  database_->async(
      [doing, number = ++last_, awaited = awaited_, newest = written_](Repositories& r) -> Status {
        if (*newest < awaited)
          return Error{ErrorCode::kStorage,
                       "how the work before ended is not written yet: make room on the disk, and try again"};
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
  awaited_ = ++last_;
  database_->owe([number = last_, newest = written_](Repositories&) {
    *newest = number;
    return Ok();
  });
}

void WorkRecord::end_job(JobId job) {
  std::erase_if(under_way_, [](const UnderWay& one) { return one.work == Work::kJob; });
  awaited_ = ++last_;
  database_->owe([job, doing = newest_doing(), number = last_, newest = written_](Repositories& r) {
    const std::string at = utc_timestamp();
    if (*newest > number) return r.jobs.stop_job(job, at);
    if (!doing.empty())
      if (Status noted = r.jobs.note_under_way(doing, at); !noted) return noted;
    // A job that never ran is refused, which is no fault.
    Status stopped = doing.empty() ? r.jobs.stop_job_and_rest(job, at) : r.jobs.stop_job(job, at);
    if (stopped || has_settled(stopped.error().code)) *newest = number;
    return stopped;
  });
}

WorkRecord::End WorkRecord::end_all_with() {
  under_way_.clear();
  return {++last_, written_};
}

void WorkRecord::write_newest() {
  database_->owe([doing = newest_doing(), number = ++last_, newest = written_](Repositories& r) {
    if (*newest > number) return Ok();
    Status noted = doing.empty() ? r.jobs.note_at_rest(utc_timestamp()) : r.jobs.note_under_way(doing, utc_timestamp());
    if (noted) *newest = number;
    return noted;
  });
}

}  // namespace veneer::daemon
