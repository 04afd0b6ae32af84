#include "daemon/unit/work_record.h"

#include <fmt/format.h>

#include <utility>

#include "base/clock.h"

namespace veneer::daemon {
namespace {

// What is under way from now on; "": nothing.
Status note_doing(Repositories& r, const std::string& doing, const std::string& at) {
  return doing.empty() ? r.jobs.note_at_rest(at) : r.jobs.note_under_way(doing, at);
}

}  // namespace

void WorkRecord::begin(Work work, const std::string& doing, Reply written) {
  under_way_.push_back({work, doing});
  database_->async(
      [doing, number = ++last_, awaited = awaited_, newest = written_,
       database = database_](Repositories& r) -> Status {
        if (*newest < awaited)
          return Error{ErrorCode::kStorage,
                       fmt::format("the end of the previous work is not saved yet: {}", database->why_owed())};
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

void WorkRecord::end_job(JobId job, const std::string& who) {
  std::erase_if(under_way_, [](const UnderWay& one) { return one.work == Work::kJob; });
  awaited_ = ++last_;
  database_->owe([job, who, doing = newest_doing(), number = last_, newest = written_](Repositories& r) {
    const std::string at = utc_timestamp();
    // Nothing newer is written before it (begin()). A job that never ran stays as it is.
    Status stopped = r.jobs.stop_job_and_rest(job, at, doing, who);
    if (!stopped && !has_settled(stopped.error().code)) return stopped;
    // Where it is refused for good nothing of it was written, and the work for the job has ended all the same.
    if (!stopped)
      if (Status noted = note_doing(r, doing, at); !noted) return noted;
    *newest = number;
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
    Status noted = note_doing(r, doing, utc_timestamp());
    if (noted) *newest = number;
    return noted;
  });
}

}  // namespace veneer::daemon
