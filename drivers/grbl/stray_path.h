// Where the beam may have been once the head may have left its path: for whoever must doubt what lies there.
//
// Between two reports the head can have gone as far as the fastest stroke of the piece takes it: in a curve half of
// that to either side, and all of it beyond the last report of a machine that was reset in motion. One that counts in
// inches has another feed as well: it goes as fast as it can. Pure; not thread-safe.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "drivers/grbl/job_run.h"
#include "drivers/grbl/reply.h"
#include "drivers/grbl/settings.h"
#include "drivers/laser_driver.h"

namespace veneer::grbl {

class StrayPath {
 public:
  StrayPath(const StatusReport::Xy& at, TimePoint now) : on_path_{{at, now, 0}} {}

  // The head was reported on its path, or off it, or after it was told to stop. Since the report before it can have
  // burnt at `fastest` at most.
  void on_path(const StatusReport::Xy& at, TimePoint heard, MmPerSecond fastest) {
    on_path_.push_back({at, heard, fastest.count()});
    while (on_path_.size() > 2 && heard - on_path_[1].heard >= kTrail) on_path_.pop_front();
    off_path_.clear();
    reports_off_ = 0;
  }
  // How many reports in a row were off the path.
  int off_path(const StatusReport::Xy& at, TimePoint heard) {
    off_path_.push_back({at, heard, 0});
    return ++reports_off_;
  }
  void stopping(const StatusReport::Xy& at, TimePoint heard) { off_path_.push_back({at, heard, 0}); }
  // The machine surely did something else than it was told.
  void strayed() { strayed_ = true; }
  void strayed_at_any_speed() { strayed_ = at_any_speed_ = true; }
  // Every report lay on the path, only the time does not fit: it may have left the path between two of the last ones.
  void late() { late_ = true; }
  // Every report lay on the path, only the end does not, by so much.
  void slipped(double mm) { slipped_mm_ = mm; }

  // A single report off the path that no second one could follow is believed.
  bool any() const { return strayed_ || late_ || slipped_mm_ || reports_off_ > 0; }
  void add_to(laser_event::Aborted& aborted, const JobRun& run, const MachineSettings& settings, Millimetres tolerance,
              TimePoint now) const;

 private:
  struct Place {
    StatusReport::Xy at;
    TimePoint heard;
    double fastest_mm_s;  // of one on the path
  };
  // A motion that takes longer than it may is noticed after half a second and what lies before it in the queue, 1.0 s.
  static constexpr Duration kTrail = std::chrono::seconds(2);

  std::deque<Place> on_path_;  // of that time, the newest last
  std::vector<Place> off_path_;
  int reports_off_ = 0;
  bool strayed_ = false;
  bool at_any_speed_ = false;
  bool late_ = false;
  std::optional<double> slipped_mm_;
};

}  // namespace veneer::grbl
