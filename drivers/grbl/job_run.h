// One job on its way through the controller: which line comes next, what is done, what would be suspect.
//
// The job goes in groups, one per piece: its lines are written when the group before is verified. Pure; not
// thread-safe.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "drivers/grbl/gcode.h"
#include "drivers/grbl/grbl_options.h"
#include "drivers/grbl/motion_queue.h"
#include "drivers/laser_job.h"
#include "drivers/stroke_groups.h"

namespace veneer::grbl {

class JobRun {
 public:
  // `job` has passed check_job(). The machine stands at `at`.
  JobRun(LaserJob job, const MachineSettings& settings, const GrblOptions& options, WirePoint at);

  // The next line, or null when the lines of the group are all out or the next one would queue too much motion.
  const GcodeLine* next() const;
  void sent(TimePoint now);  // the line next() gave
  void acknowledged(const GcodeLine& line, TimePoint now);
  bool all_sent() const { return next_ >= lines_.size(); }

  MotionQueue& motion() { return motion_; }
  const MotionQueue& motion() const { return motion_; }

  // Lines of the group are sent, answered, executed and the position agrees. Goes on to the next group, if there is one
  // and it is wanted. Gives the piece that is now verified.
  std::optional<PieceId> verified();
  bool finished() const { return finished_; }

  void stop_after_piece() { stop_after_piece_ = true; }
  bool stopped_early() const { return stopped_early_; }
  // The lid was opened, and the beam may have been on until the machine stood still here: the piece under way may have
  // a gap. It is finished, but not verified.
  void doubt(const StatusReport::Xy& at) { doubt_at_ = at; }
  const std::optional<StatusReport::Xy>& doubt_at() const { return doubt_at_; }
  PieceId piece() const { return job_.strokes[group_.begin].piece; }  // under way
  bool burning_begun() const { return burning_begun_; }               // of the piece under way
  bool nothing_sent() const { return group_.begin == 0 && next_ == 0; }
  // Of the piece under way: its strokes one after the other, and the fastest of them.
  Polyline<MachineFrame> path_under_way() const;
  MmPerSecond fastest_under_way() const;
  // Of the strokes that are sent and not surely executed.
  MmPerSecond fastest_in_flight() const;
  // Begun to burn and not verified.
  std::vector<PieceId> suspect() const;

 private:
  void write_group_from(std::size_t begin);

  LaserJob job_;
  MachineSettings settings_;
  GrblOptions options_;
  MotionQueue motion_;
  StrokeGroup group_;  // under way
  std::vector<GcodeLine> lines_;
  std::size_t next_ = 0;
  bool burning_begun_ = false;
  std::optional<StatusReport::Xy> doubt_at_;
  int gates_ = 0;  // echoes unanswered before which nothing may move
  bool stop_after_piece_ = false;
  bool finished_ = false;
  bool stopped_early_ = false;
};

}  // namespace veneer::grbl
