// The order in which jobs are cut.
#include <fmt/format.h>

#include <algorithm>

#include "db/job_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

// With those that do not wait now, which keep their places until they do again.
std::vector<JobId> order_of(SQLite::Database& connection) {
  std::vector<JobId> out;
  for (const JobWork& job : jobs_with_work(connection)) out.push_back(job.id);
  return out;
}

std::vector<JobId> queue_of(SQLite::Database& connection) {
  std::vector<JobId> out;
  for (const JobWork& job : jobs_with_work(connection))
    if (job.open > 0 && job.state != JobState::kRunning) out.push_back(job.id);
  return out;
}

Status expect_queued(SQLite::Database& connection, const std::vector<JobId>& queue, JobId job) {
  if (std::ranges::find(queue, job) != queue.end()) return Ok();
  const auto state = state_of(connection, job);
  if (!state.ok()) return state.error();
  if (*state == JobState::kRunning)
    return Error{
        ErrorCode::kConflict,
        fmt::format("job {} is being cut and does not wait in the queue: move others, or stop it before", job.value)};
  return Error{ErrorCode::kConflict, fmt::format("job {} is {} and has no piece to cut, so it does not stand in the "
                                                 "queue: see `veneerctl job list`",
                                                 job.value, to_string(*state))};
}

// `job` put right before `other`, or behind all.
std::vector<JobId> moved(std::vector<JobId> order, JobId job, std::optional<JobId> other) {
  std::erase(order, job);
  order.insert(other ? std::ranges::find(order, *other) : order.end(), job);
  return order;
}

}  // namespace

Result<std::vector<JobId>> JobStore::queue() {
  return guarded(*database_,
                 [&](SQLite::Database& connection) -> Result<std::vector<JobId>> { return queue_of(connection); });
}

Result<std::vector<JobId>> JobStore::put_before(JobId job, std::optional<JobId> other, const std::string& who,
                                                const std::string& at) {
  if (other == job)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("job {} cannot stand before itself: name another job", job.value)};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<std::vector<JobId>> {
    const std::vector<JobId> before = queue_of(connection);
    for (const JobId one : {job, other.value_or(job)})
      if (Status queued = expect_queued(connection, before, one); !queued.ok()) return queued.error();
    std::vector<JobId> queue = moved(before, job, other);
    if (queue == before) return queue;
    std::vector<std::int64_t> numbers;
    for (const JobId one : moved(order_of(connection), job, other)) numbers.push_back(one.value);
    SQLite::Statement insert(connection, "INSERT INTO queue_orders (job, jobs, who, at) VALUES (?, ?, ?, ?)");
    SQLite::bind(insert, job.value, fmt::format("[{}]", fmt::join(numbers, ",")), who, at);
    insert.exec();
    return queue;
  });
}

}  // namespace veneer::db
