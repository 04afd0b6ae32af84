#include "daemon/plans/run_strokes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace veneer::daemon {
namespace {

constexpr std::size_t kLongestPart = 1000;  // points

Error unfit(const std::string& what) { return {ErrorCode::kInvalidArgument, what}; }

bool is_whole(double value) { return value == std::floor(value); }

void add_in_parts(const Stroke& whole, LaserJob& job) {
  const auto& path = whole.path;
  for (std::size_t begin = 0; begin + 1 < path.size(); begin += kLongestPart - 1) {
    const std::size_t end = std::min(path.size(), begin + kLongestPart);
    Stroke part = whole;
    part.path.assign(path.begin() + static_cast<std::ptrdiff_t>(begin),
                     path.begin() + static_cast<std::ptrdiff_t>(end));
    job.strokes.push_back(std::move(part));
  }
}

Status check_lists(const DrawnStrokes& s) {
  const std::size_t strokes = s.points_per_stroke.size();
  if (strokes == 0) return unfit("strokes is empty: say how many points each stroke has");
  double points = 0;
  for (const double count : s.points_per_stroke) {
    if (!is_whole(count) || count < 2) return unfit("strokes must be whole numbers of points, at least 2");
    points += count;
  }
  if (points > static_cast<double>(kMostPointsToRun))
    return unfit(fmt::format("it has more than {} points: split the drawing", kMostPointsToRun));
  if (2 * points != static_cast<double>(s.points_mm.size()))
    return unfit(fmt::format("points_mm has {} numbers, but strokes asks for {}: give two for each point",
                             s.points_mm.size(), 2 * points));
  for (const auto& [name, list] :
       {std::pair("speeds_mm_s", &s.speeds_mm_s), {"powers", &s.powers}, {"passes", &s.passes}, {"air", &s.air}})
    if (list->size() != 1 && list->size() != strokes)
      return unfit(fmt::format("{} must have one number, or one for each of the {} strokes", name, strokes));
  if (!std::all_of(s.passes.begin(), s.passes.end(), is_whole)) return unfit("passes must be whole numbers");
  return Ok();
}

}  // namespace

Result<LaserJob> job_of_strokes(const DrawnStrokes& s, bool dry) {
  if (const Status good = check_lists(s); !good) return good.error();
  const auto of = [](const std::vector<double>& list, std::size_t i) { return list.size() == 1 ? list[0] : list[i]; };
  LaserJob job;
  auto at = s.points_mm.begin();
  for (std::size_t i = 0; i < s.points_per_stroke.size(); ++i) {
    Stroke stroke;
    stroke.role = StrokeRole::kPattern;
    for (auto left = static_cast<std::size_t>(s.points_per_stroke[i]); left > 0; --left, at += 2)
      stroke.path.push_back(point<MachineFrame>(*at, *(at + 1)));
    stroke.speed = MmPerSecond(of(s.speeds_mm_s, i));
    stroke.power = PowerFraction(dry ? 0 : of(s.powers, i));
    stroke.passes = static_cast<int>(of(s.passes, i));
    stroke.air = of(s.air, i) != 0;
    add_in_parts(stroke, job);
  }
  return job;
}

Millimetres length_of(const LaserJob& job) {
  Millimetres length{0};
  for (const Stroke& stroke : job.strokes)
    for (std::size_t i = 1; i < stroke.path.size(); ++i)
      length = length + distance(stroke.path[i - 1], stroke.path[i]) * stroke.passes;
  return length;
}

Status check_fits(const LaserJob& job, const LaserLimits& limits) {
  Box<MachineFrame> box;
  for (const Stroke& stroke : job.strokes)
    for (const auto& p : stroke.path) box.add(p);
  const Box<MachineFrame>& travel = limits.travel;
  if (travel.contains(box.min) && travel.contains(box.max)) return Ok();
  return unfit(
      fmt::format("the drawing lies at x {:.1f} to {:.1f}, y {:.1f} to {:.1f} mm and leaves the laser's travel (x "
                  "{:.1f} to {:.1f}, y {:.1f} to {:.1f} mm): place it elsewhere (--x-mm, --y-mm), or "
                  "make it smaller",
                  box.min.x.count(), box.max.x.count(), box.min.y.count(), box.max.y.count(), travel.min.x.count(),
                  travel.max.x.count(), travel.min.y.count(), travel.max.y.count()));
}

void return_to_corner(LaserJob& job, const LaserLimits& limits, MmPerSecond speed) {
  if (limits.finds_home || job.strokes.empty()) return;
  const Point<MachineFrame> end = job.strokes.back().path.back();
  if (end == limits.travel.min) return;
  Stroke& back = job.strokes.emplace_back();
  back.role = StrokeRole::kPattern;
  back.path = {end, limits.travel.min};
  back.speed = speed;
}

}  // namespace veneer::daemon
