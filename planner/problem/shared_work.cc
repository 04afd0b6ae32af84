#include "planner/problem/shared_work.h"

#include <algorithm>
#include <cstring>

#include "planner/pictures/features.h"

namespace veneer::planner {
namespace {

bool same(const Raster<PanelFrame>& a, const Raster<PanelFrame>& b) {
  if (a.pixels.size() != b.pixels.size() || a.pixels.type() != b.pixels.type()) return false;
  if (a.resolution.px_per_mm != b.resolution.px_per_mm || !(a.origin == b.origin)) return false;
  const std::size_t row_bytes = static_cast<std::size_t>(a.pixels.cols) * a.pixels.elemSize();
  for (int r = 0; r < a.pixels.rows; ++r)
    if (std::memcmp(a.pixels.ptr(r), b.pixels.ptr(r), row_bytes) != 0) return false;
  return true;
}

bool same(const MatchPanel& a, const MatchPanel& b) {
  return same(a.features, b.features) && same(a.wood.raster(), b.wood.raster()) && a.wood.kerf() == b.wood.kerf() &&
         a.wood.border() == b.wood.border() && a.grain.size() == b.grain.size();
}

}  // namespace

SharedWork::Made SharedWork::made_for(const Problem& problem, const PlanOptions& options) {
  return {options.exact,        options.rotations, problem.entries_per_unit, largest_response(options),
          options.thoroughness, problem.classes};
}

Result<std::unique_ptr<Matcher>> SharedWork::matcher_for(Problem& problem, const PlanOptions& options, int threads,
                                                         const std::stop_token& stop) {
  std::unique_ptr<Matcher> before = std::move(matcher_), none;
  if (before == nullptr || !(made_for(problem, options) == made_)) return none;
  if (!std::equal(before->panels().begin(), before->panels().end(), problem.panels.begin(), problem.panels.end(),
                  [](const MatchPanel& a, const MatchPanel& b) { return same(a, b); }))
    return none;
  problem.panels.clear();
  if (const Status free = before->give_back(threads, stop); !free.ok()) return free.error();
  return before;
}

void SharedWork::keep(std::unique_ptr<Matcher> matcher, const Problem& problem, const PlanOptions& options) {
  // Wood that kept pieces hold is gone for this plan alone.
  if (!options.kept.empty()) return;
  matcher_ = std::move(matcher);
  made_ = made_for(problem, options);
}

}  // namespace veneer::planner
