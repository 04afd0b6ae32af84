#include "daemon/services/cell_counts.h"

#include <boost/asio/post.hpp>
#include <utility>

#include "base/clock.h"
#include "daemon/unit/cell_view.h"

namespace veneer::daemon {
namespace {

void count_work(Repositories& r, CellCounts& counts) {
  const auto jobs = r.jobs.with_work();
  if (!jobs) return;
  for (const db::JobRecord& job : *jobs) {
    const JobRest rest = rest_of(job);
    if (rest.suspect > 0) counts.suspects.push_back({job.id, rest.suspect});
    if (!counts.job && rest.open > 0 && job.state != db::JobState::kRunning)
      counts.job = CellNeeds::Waiting{job.id.value, job.name, rest.open};
  }
}

std::optional<CellNeeds::Waiting> waiting_plan_of(Repositories& r) {
  const auto plans = r.plans.list({0}, 1);
  if (!plans || plans->empty()) return std::nullopt;
  const db::PlanRecord& plan = plans->front();
  if (!plan.jobs.empty() || !plan.outdated.empty()) return std::nullopt;
  return CellNeeds::Waiting{plan.id.value, plan.name, plan.placed};
}

}  // namespace

CellCounts count_cell(Repositories& r) {
  CellCounts counts;
  count_work(r, counts);
  counts.plan = waiting_plan_of(r);
  if (auto list = r.panels.in_stock()) counts.panels = static_cast<int>(list->size());
  if (const auto open = r.proposals.list(false); open && !open->empty()) counts.proposal = open->back().id;
  if (const auto waiting = r.facts.panels_to_scan())
    for (const db::PanelToScan& one : *waiting) counts.panels_to_scan.push_back(one.panel);
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
  const auto work = [this, end_with] {
    end_with(database_.read([](Repositories& r) { return Result(count_cell(r)); }));
  };
  if (worker_.try_post({1}, work, end_with)) ++to_come_;
}

void CellCounter::end(Result<CellCounts> counted) {
  --to_come_;
  if (!counted) return log_->warn("the cell's status is not counted anew: {}", counted.error().message);
  told_(std::move(*counted));
}

}  // namespace veneer::daemon
