#include "drivers/lihuiyu/job_run.h"

#include <utility>

#include "drivers/lihuiyu/packet.h"

namespace veneer::lihuiyu {

JobRun::JobRun(LaserJob job, const MilGrid& grid, const LihuiyuOptions& options, MilPoint at)
    : job_(std::move(job)),
      grid_(grid),
      options_{.board = options.board, .packet_motion_s = options.packet_motion_s},
      at_(at) {
  write_group_from(0);
}

void JobRun::write_group_from(std::size_t begin) {
  group_ = group_from(job_, begin);
  programs_ = write_programs(strokes_of(job_, group_), group_.begin, at_, grid_, options_);
  begun_ = false;
  begin_program(0);
}

void JobRun::begin_program(std::size_t program) {
  program_ = program;
  packets_ = make_packets(programs_[program].text);
  if (const auto power = programs_[program].power_permille) packets_.insert(packets_.begin(), power_packet(*power));
  next_ = 0;
}

bool JobRun::may_finish() const {
  return next_ + 1 == packets_.size() || (next_ == 0 && programs_[program_].power_permille);
}

std::optional<PieceId> JobRun::program_ended() {
  at_ = programs_[program_].end;
  if (program_ + 1 < programs_.size()) {
    begin_program(program_ + 1);
    return std::nullopt;
  }
  const PieceId done = piece();
  stopped_early_ = stop_after_piece_ && group_.end < job_.strokes.size();
  finished_ = stopped_early_ || group_.end == job_.strokes.size();
  if (!finished_) write_group_from(group_.end);
  return done == PieceId{} ? std::nullopt : std::optional(done);
}

std::vector<PieceId> JobRun::suspect() const {
  if (!begun_ || finished_ || piece() == PieceId{}) return {};
  return {piece()};
}

}  // namespace veneer::lihuiyu
