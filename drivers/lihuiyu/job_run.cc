#include "drivers/lihuiyu/job_run.h"

#include <span>
#include <utility>

#include "drivers/lihuiyu/packet.h"

namespace veneer::lihuiyu {

JobRun::JobRun(LaserJob job, const MilGrid& grid, const LihuiyuOptions& options, MilPoint at)
    : job_(std::move(job)),
      grid_(grid),
      options_{.board = options.board, .packet_motion_s = options.packet_motion_s},
      at_(at) {
  write_next_group();
}

void JobRun::write_next_group() {
  group_begin_ = group_end_;
  const PieceId piece = job_.strokes[group_begin_].piece;
  while (group_end_ < job_.strokes.size() && job_.strokes[group_end_].piece == piece) ++group_end_;
  programs_ = write_programs(std::span(job_.strokes).subspan(group_begin_, group_end_ - group_begin_), group_begin_,
                             at_, grid_, options_);
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
  const PieceId piece = job_.strokes[group_begin_].piece;
  stopped_early_ = stop_after_piece_ && group_end_ < job_.strokes.size();
  finished_ = stopped_early_ || group_end_ == job_.strokes.size();
  if (!finished_) write_next_group();
  return piece == PieceId{} ? std::nullopt : std::optional(piece);
}

std::vector<PieceId> JobRun::suspect() const {
  if (!begun_ || finished_ || job_.strokes[group_begin_].piece == PieceId{}) return {};
  return {job_.strokes[group_begin_].piece};
}

}  // namespace veneer::lihuiyu
