// Figures for Prometheus: what the cell did since the daemon began, and how it is. The one door to prometheus-cpp.
//
// Bound to the reactor.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "daemon/news/alarm_book.h"
#include "daemon/unit/cell_view.h"

namespace veneer::daemon {

class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // With each change of the unit; jobs and pieces are counted by what differs from the last time.
  void follow(const CellView& view, bool laser_connected);
  // `outcome`: done, failed or cancelled.
  void task_ended(std::string_view kind, std::string_view outcome);
  // `outcome`: delivered, failed or dropped.
  void notice_ended(std::string_view outcome);
  // From STOP's having been read to its byte's having been given to the wire.
  void stop_taken(Duration to_the_wire);

  struct Now {
    std::size_t connections = 0, listeners = 0;  // of the API; of those, to its events
    int panels = 0;
    const AlarmBook* alarms = nullptr;
  };
  // In Prometheus' text format 0.0.4.
  std::string text(const Now& now);

 private:
  struct Figures;
  std::unique_ptr<Figures> figures_;
  CellState state_ = CellState::kStopped;
  bool has_cut_ = false;  // since a job ended last
  JobId job_{0};
  int cut_ = 0, suspect_ = 0;
};

}  // namespace veneer::daemon
