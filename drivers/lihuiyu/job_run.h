// One job on its way through the board: which packet comes next, which strokes are done, what would be suspect.
//
// The job goes in groups, one per piece; a group in programs, one per speed and power. A program is written when the
// one before has ended. Pure; not thread-safe.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "drivers/laser_job.h"
#include "drivers/lihuiyu/lihuiyu_options.h"
#include "drivers/stroke_groups.h"

namespace veneer::lihuiyu {

class JobRun {
 public:
  // `job` has passed check_job(). The head stands at `at`.
  JobRun(LaserJob job, const MilGrid& grid, const LihuiyuOptions& options, MilPoint at);

  bool all_sent() const { return next_ >= packets_.size(); }
  const std::string& packet() const { return packets_[next_]; }
  bool first_of_program() const { return next_ == 0; }
  // The board may be finished as soon as it has the packet: with the program, or with setting its power.
  bool may_finish() const;
  // The packet is about to be written: from now on the piece may be burnt.
  void sending() { begun_ = true; }
  void accepted() { ++next_; }
  const Program& program() const { return programs_[program_]; }

  // The board has ended the program. Goes on to the next, if there is one and it is wanted. Gives the piece that is now
  // verified.
  std::optional<PieceId> program_ended();
  bool finished() const { return finished_; }

  void stop_after_piece() { stop_after_piece_ = true; }
  bool stopped_early() const { return stopped_early_; }
  // Begun to be written and not verified.
  std::vector<PieceId> suspect() const;
  // Where the program under way began. Whatever the board has lost or misread of it, the beam has not been farther from
  // here than the program is long.
  Point<MachineFrame> program_begin() const { return grid_.from_board(program().begin); }
  MilPoint at() const { return at_; }  // where the last program that ended has left the head

 private:
  PieceId piece() const { return job_.strokes[group_.begin].piece; }  // under way
  void write_group_from(std::size_t begin);
  void begin_program(std::size_t program);

  LaserJob job_;
  MilGrid grid_;
  EncoderOptions options_;
  MilPoint at_;
  StrokeGroup group_;  // under way
  std::vector<Program> programs_;
  std::size_t program_ = 0;
  std::vector<std::string> packets_;
  std::size_t next_ = 0;
  bool begun_ = false;
  bool stop_after_piece_ = false;
  bool finished_ = false;
  bool stopped_early_ = false;
};

}  // namespace veneer::lihuiyu
