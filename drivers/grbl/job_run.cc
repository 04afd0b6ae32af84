#include "drivers/grbl/job_run.h"

#include <span>
#include <utility>

namespace veneer::grbl {

JobRun::JobRun(LaserJob job, const MachineSettings& settings, const GrblOptions& options, WirePoint at)
    : job_(std::move(job)),
      settings_(settings),
      options_(options),
      motion_({.longest_s = options.queued_motion_s, .planner_blocks = settings.planner_blocks}) {
  motion_.start_at(at);
  write_next_group();
}

const GcodeLine* JobRun::next() const {
  if (all_sent()) return nullptr;
  const GcodeLine& line = lines_[next_];
  return line.moves() && (gates_ > 0 || !motion_.fits(line)) ? nullptr : &line;
}

void JobRun::sent(TimePoint now) {
  const GcodeLine& line = lines_[next_++];
  if (line.moves()) motion_.sent(line, now);
  if (line.kind == LineKind::kBurn) burning_begun_ = true;
  if (line.gate) ++gates_;
}

void JobRun::acknowledged(const GcodeLine& line, TimePoint now) {
  if (line.moves()) motion_.acknowledged(now);
  if (line.gate) --gates_;
}

std::optional<PieceId> JobRun::verified() {
  const PieceId piece = job_.strokes[group_begin_].piece;
  burning_begun_ = false;
  stopped_early_ = stop_after_piece_ && group_end_ < job_.strokes.size();
  finished_ = stopped_early_ || group_end_ == job_.strokes.size();
  if (!finished_) write_next_group();
  return piece == PieceId{} ? std::nullopt : std::optional(piece);
}

void JobRun::write_next_group() {
  group_begin_ = group_end_;
  next_ = 0;
  const PieceId piece = job_.strokes[group_begin_].piece;
  while (group_end_ < job_.strokes.size() && job_.strokes[group_end_].piece == piece) ++group_end_;
  lines_ = write_group(std::span(job_.strokes).subspan(group_begin_, group_end_ - group_begin_), group_begin_,
                       motion_.end(), settings_, options_.longest_move_s);
}

std::vector<PieceId> JobRun::suspect() const {
  if (!burning_begun_ || job_.strokes[group_begin_].piece == PieceId{}) return {};
  return {job_.strokes[group_begin_].piece};
}

}  // namespace veneer::grbl
