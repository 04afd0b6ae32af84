// Where the beam may have been once the head may have left its path: for whoever must doubt what lies there.
//
// Between two reports the head can have gone as far as the fastest stroke of the piece takes it: in a curve half of
// that to either side, and all of it beyond the last report of a machine that was reset in motion. Pure; not
// thread-safe.
#pragma once

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
  StrayPath(const StatusReport::Xy& at, TimePoint now) : on_path_{at, now} {}

  // The head was reported on its path, or off it, or after it was told to stop.
  void on_path(const StatusReport::Xy& at, TimePoint heard) {
    on_path_ = {at, heard};
    off_path_.clear();
    reports_off_ = 0;
  }
  // How many reports in a row were off the path.
  int off_path(const StatusReport::Xy& at, TimePoint heard) {
    off_path_.push_back({at, heard});
    return ++reports_off_;
  }
  void stopping(const StatusReport::Xy& at, TimePoint heard) { off_path_.push_back({at, heard}); }
  // The machine surely did something else than it was told.
  void strayed() { strayed_ = true; }
  // Every report lay on the path, only the end does not, by so much.
  void slipped(double mm) { slipped_mm_ = mm; }

  // A single report off the path that no second one could follow is believed.
  bool any() const { return strayed_ || slipped_mm_ || reports_off_ > 0; }
  void add_to(laser_event::Aborted& aborted, const JobRun& run, const MachineSettings& settings, Millimetres tolerance,
              TimePoint now) const;

 private:
  struct Place {
    StatusReport::Xy at;
    TimePoint heard;
  };
  Place on_path_;
  std::vector<Place> off_path_;
  int reports_off_ = 0;
  bool strayed_ = false;
  std::optional<double> slipped_mm_;
};

}  // namespace veneer::grbl
