#include "daemon/news/cell_counts.h"

#include <boost/asio/post.hpp>
#include <utility>

#include "base/clock.h"

namespace veneer::daemon {
namespace {

Status count_work(Repositories& r, CellCounts& counts) {
  const auto jobs = r.jobs.with_work();
  if (!jobs) return jobs.error();
  for (const db::JobWork& job : *jobs) {
    if (job.suspect > 0) counts.suspects.push_back({job.id, job.suspect});
    if (!counts.job && job.open > 0 && job.state != db::JobState::kRunning)
      counts.job = CellNeeds::Waiting{job.id.value, job.name, job.open};
  }
  auto missing = r.jobs.with_loss();
  if (!missing) return missing.error();
  counts.missing = std::move(*missing);
  return Ok();
}

Status count_plans(Repositories& r, CellCounts& counts) {
  const auto plans = r.plans.list({0}, 1);
  if (!plans) return plans.error();
  if (plans->empty() || !plans->front().jobs.empty() || !plans->front().outdated.empty()) return Ok();
  counts.plan = CellNeeds::Waiting{plans->front().id.value, plans->front().name, plans->front().placed};
  return Ok();
}

Status count_stock(Repositories& r, CellCounts& counts) {
  const auto panels = r.panels.in_stock();
  if (!panels) return panels.error();
  counts.panels = static_cast<int>(panels->size());
  const auto open = r.proposals.list(false);
  if (!open) return open.error();
  if (!open->empty()) counts.proposal = open->back().id;
  const auto waiting = r.facts.panels_to_scan();
  if (!waiting) return waiting.error();
  for (const db::PanelToScan& one : *waiting) counts.panels_to_scan.push_back(one.panel);
  return Ok();
}

}  // namespace

Result<CellCounts> count_cell(Repositories& r) {
  CellCounts counts;
  counts.counted = true;
  for (const auto count : {count_work, count_plans, count_stock})
    if (Status done = count(r, counts); !done) return done.error();
  // A certificate that cannot be read is one that is missing.
  if (auto valid = load_calibration(r, utc_timestamp())) counts.calibration = std::move(*valid);
  return counts;
}

CellCounter::CellCounter(DatabaseThread& database, boost::asio::io_context& reactor, Told told, Logger log)
    : database_(database),
      reactor_(reactor),
      told_(std::move(told)),
      log_(std::move(log)),
      alive_(std::make_shared<CellCounter*>(this)) {}

CellCounter::~CellCounter() = default;

void CellCounter::count() {
  const auto end_with = [this](Result<CellCounts> counted) {
    boost::asio::post(reactor_, [counter = std::weak_ptr(alive_), counted = std::move(counted)]() mutable {
      if (const auto alive = counter.lock()) (*alive)->end(std::move(counted));
    });
  };
  const auto work = [this, end_with] { end_with(database_.read(reader_, count_cell)); };
  if (worker_.try_post({1}, work, end_with)) ++to_come_;
}

void CellCounter::end(Result<CellCounts> counted) {
  --to_come_;
  if (!counted) {
    if (!std::exchange(failed_, true)) log_->warn("the cell's status is not counted anew: {}", counted.error().message);
    return;
  }
  failed_ = false;
  told_(std::move(*counted));
}

}  // namespace veneer::daemon
