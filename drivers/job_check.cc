#include "drivers/job_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace veneer {
namespace {

Status check_stroke(const Stroke& stroke, std::size_t index, const JobLimits& limits) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("stroke {} of the job {}", index, what)};
  };
  if (stroke.path.size() < 2) return refuse("has fewer than two points");
  if (stroke.passes < 1 || stroke.passes > 100) return refuse("has an impossible number of passes");
  if (!(stroke.power.count() >= 0 && stroke.power.count() <= 1)) return refuse("has a power outside 0 to 100 %");
  if (!(stroke.speed.count() > 0 && stroke.speed >= limits.slowest && stroke.speed <= limits.fastest))
    return refuse("has a speed outside " + limits.speed_words);
  Polyline<MachineFrame> reached = stroke.path;
  if (limits.overscan) {
    if (!(stroke.overscan.count() >= 0 && stroke.overscan.count() < 100)) return refuse("has an impossible overscan");
    if (stroke.overscan.count() > 0) {
      reached.push_back(beyond(stroke.path[0], stroke.path[1], stroke.overscan));
      reached.push_back(beyond(*stroke.path.rbegin(), *(stroke.path.rbegin() + 1), stroke.overscan));
    }
  }
  const Box<MachineFrame>& travel = limits.travel;
  for (const auto& p : reached)
    if (!std::isfinite(p.x.count()) || !std::isfinite(p.y.count()) || !travel.contains(p))
      return refuse(
          fmt::format("leaves the machine's travel at ({:.2f}, {:.2f}) mm (x is {:.1f} to {:.1f}, y is {:.1f} "
                      "to {:.1f}): lay the panel nearer to the middle of the bed",
                      p.x.count(), p.y.count(), travel.min.x.count(), travel.max.x.count(), travel.min.y.count(),
                      travel.max.y.count()));
  const bool moves = std::any_of(reached.begin(), reached.end(),
                                 [&](const auto& p) { return !limits.same_place(p, stroke.path.front()); });
  return moves ? Ok() : refuse("has no length");
}

}  // namespace

Status check_job(const LaserJob& job, const JobLimits& limits) {
  if (job.strokes.empty()) return Error{ErrorCode::kInvalidArgument, "the job has no strokes"};
  std::set<PieceId> finished;
  for (std::size_t i = 0; i < job.strokes.size(); ++i) {
    if (Status status = check_stroke(job.strokes[i], i, limits); !status.ok()) return status;
    const PieceId piece = job.strokes[i].piece;
    if (i > 0 && piece != job.strokes[i - 1].piece) finished.insert(job.strokes[i - 1].piece);
    if (piece != PieceId{} && finished.contains(piece))
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the strokes of piece {} are not adjacent in the job", piece.value)};
  }
  return Ok();
}

Point<MachineFrame> beyond(const Point<MachineFrame>& end, const Point<MachineFrame>& before, Millimetres by) {
  const double share = by.count() / std::max(1e-6, distance(end, before).count());
  return {end.x + (end.x - before.x) * share, end.y + (end.y - before.y) * share};
}

}  // namespace veneer
