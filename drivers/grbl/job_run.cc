#include "drivers/grbl/job_run.h"

#include <algorithm>
#include <utility>

namespace veneer::grbl {

JobRun::JobRun(LaserJob job, const MachineSettings& settings, const GrblOptions& options, WirePoint at)
    : job_(std::move(job)),
      settings_(settings),
      options_(options),
      motion_({.longest_s = options.queued_motion_s, .planner_blocks = settings.planner_blocks}) {
  motion_.start_at(at);
  write_group_from(0);
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
  const PieceId done = piece();
  burning_begun_ = false;
  stopped_early_ = stop_after_piece_ && group_.end < job_.strokes.size();
  finished_ = stopped_early_ || group_.end == job_.strokes.size();
  if (!finished_) write_group_from(group_.end);
  return done == PieceId{} ? std::nullopt : std::optional(done);
}

void JobRun::write_group_from(std::size_t begin) {
  group_ = group_from(job_, begin);
  next_ = 0;
  lines_ = write_group(strokes_of(job_, group_), group_.begin, motion_.end(), settings_, options_.longest_move_s);
}

Polyline<MachineFrame> JobRun::path_under_way() const {
  Polyline<MachineFrame> path;
  for (const Stroke& stroke : strokes_of(job_, group_)) path.insert(path.end(), stroke.path.begin(), stroke.path.end());
  return path;
}

MmPerSecond JobRun::fastest_under_way() const {
  MmPerSecond fastest{0};
  for (const Stroke& stroke : strokes_of(job_, group_)) fastest = std::max(fastest, stroke.speed);
  return fastest;
}

MmPerSecond JobRun::fastest_in_flight() const {
  MmPerSecond fastest{0};
  if (const auto strokes = motion_.strokes_in_flight())
    for (std::size_t i = strokes->first; i <= strokes->second; ++i) fastest = std::max(fastest, job_.strokes[i].speed);
  return fastest;
}

std::vector<PieceId> JobRun::suspect() const {
  if (!burning_begun_ || piece() == PieceId{}) return {};
  return {piece()};
}

}  // namespace veneer::grbl
