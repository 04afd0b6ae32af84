#include "daemon/news/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>

namespace veneer::daemon {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;

constexpr std::array kStates = {CellState::kStopped,   CellState::kResetting,  CellState::kIdle,
                                CellState::kStarting,  CellState::kExecute,    CellState::kHolding,
                                CellState::kHeld,      CellState::kUnholding,  CellState::kSuspending,
                                CellState::kSuspended, CellState::kCompleting, CellState::kUnsuspending,
                                CellState::kComplete,  CellState::kStopping,   CellState::kAborting,
                                CellState::kAborted,   CellState::kClearing};

// How a job's time at the machine ended; nullptr while it goes on.
const char* outcome_of(CellState state) {
  switch (state) {
    case CellState::kComplete:
      return "complete";
    case CellState::kStopped:
      return "stopped";
    case CellState::kAborted:
      return "aborted";
    default:
      return nullptr;
  }
}

}  // namespace

struct Metrics::Figures {
  prometheus::Registry registry;
  Family<Gauge>& state = prometheus::BuildGauge()
                             .Name("veneerd_state")
                             .Help("The unit's PackML state: 1 for the one it is in")
                             .Register(registry);
  Gauge& laser = prometheus::BuildGauge()
                     .Name("veneerd_laser_connected")
                     .Help("1 while the laser's controller answers")
                     .Register(registry)
                     .Add({});
  Family<Counter>& jobs = prometheus::BuildCounter()
                              .Name("veneerd_jobs_total")
                              .Help("Times that the cutting of a job ended, by how")
                              .Register(registry);
  Family<Counter>& notices = prometheus::BuildCounter()
                                 .Name("veneerd_notifications_total")
                                 .Help("Notices to webhook and MQTT broker, by what became of them")
                                 .Register(registry);
  Family<Counter>& pieces = prometheus::BuildCounter()
                                .Name("veneerd_pieces_total")
                                .Help("Pieces of the job under way that became cut or suspect")
                                .Register(registry);
  Family<Counter>& tasks = prometheus::BuildCounter()
                               .Name("veneerd_tasks_total")
                               .Help("Long work (scans, plans, calibrations, ...) that ended, by kind and how")
                               .Register(registry);
  // 50 ms is what is asked of the 99th of a hundred.
  Histogram& stops = prometheus::BuildHistogram()
                         .Name("veneerd_stop_to_wire_seconds")
                         .Help("From STOP's having been read to its byte's having been given to the wire")
                         .Register(registry)
                         .Add({}, Histogram::BucketBoundaries{0.0001, 0.001, 0.005, 0.01, 0.025, 0.05, 0.1, 0.5});
  Family<Gauge>& connections = prometheus::BuildGauge()
                                   .Name("veneerd_connections")
                                   .Help("Open connections to the API, and those of them that hear its events")
                                   .Register(registry);
  Gauge& panels = prometheus::BuildGauge().Name("veneerd_panels").Help("Panels in stock").Register(registry).Add({});
  Family<Gauge>& alarms =
      prometheus::BuildGauge().Name("veneerd_alarms").Help("Alarms that are not over, by state").Register(registry);

  Figures() {
    // A counter that is there from the beginning tells its first increase.
    for (const char* outcome : {"complete", "stopped", "aborted"}) jobs.Add({{"outcome", outcome}});
    for (const char* became : {"cut", "suspect"}) pieces.Add({{"became", became}});
  }
};

Metrics::Metrics() : figures_(std::make_unique<Figures>()) {}
Metrics::~Metrics() = default;

void Metrics::follow(const CellView& view, bool laser_connected) {
  figures_->laser.Set(laser_connected ? 1 : 0);
  if (view.job && view.job->id == job_) {
    figures_->pieces.Add({{"became", "cut"}}).Increment(std::max(0, view.job->cut - cut_));
    figures_->pieces.Add({{"became", "suspect"}}).Increment(std::max(0, view.job->suspect - suspect_));
  }
  // What ends is the job that was there until now.
  const JobId was = job_;
  job_ = view.job ? view.job->id : JobId{0};
  cut_ = view.job ? view.job->cut : 0;
  suspect_ = view.job ? view.job->suspect : 0;
  const bool turned = view.state != state_;
  // Cleared is not ended once more.
  const bool from_end = state_ == CellState::kAborted || state_ == CellState::kClearing;
  state_ = view.state;
  if (view.state == CellState::kExecute) has_cut_ = true;
  const char* outcome = outcome_of(view.state);
  if (!turned || !outcome) return;
  // Back in Complete, when what was to be cut again was not.
  const bool is_end = view.state != CellState::kComplete || has_cut_;
  has_cut_ = false;
  if (was.value != 0 && !from_end && is_end) figures_->jobs.Add({{"outcome", outcome}}).Increment();
}

void Metrics::task_ended(std::string_view kind, std::string_view outcome) {
  figures_->tasks.Add({{"kind", std::string(kind)}, {"outcome", std::string(outcome)}}).Increment();
}

void Metrics::notice_ended(std::string_view outcome) {
  figures_->notices.Add({{"outcome", std::string(outcome)}}).Increment();
}

void Metrics::stop_taken(Duration to_the_wire) {
  figures_->stops.Observe(std::chrono::duration<double>(to_the_wire).count());
}

std::string Metrics::text(const Now& now) {
  for (const CellState state : kStates)
    figures_->state.Add({{"state", std::string(to_string(state))}}).Set(state == state_ ? 1 : 0);
  figures_->connections.Add({{"of", "all"}}).Set(static_cast<double>(now.connections));
  figures_->connections.Add({{"of", "events"}}).Set(static_cast<double>(now.listeners));
  figures_->panels.Set(now.panels);
  if (now.alarms != nullptr)
    for (const AlarmState state : {AlarmState::kNew, AlarmState::kAcknowledged, AlarmState::kReturned})
      figures_->alarms.Add({{"state", std::string(to_string(state))}}).Set(now.alarms->count(state));
  return prometheus::TextSerializer().Serialize(figures_->registry.Collect());
}

}  // namespace veneer::daemon
