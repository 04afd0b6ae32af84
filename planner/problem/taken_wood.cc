#include "planner/problem/taken_wood.h"

#include "planner/cancelled.h"

namespace veneer::planner {

Status take_anew(Matcher& matcher, const Problem& problem, std::span<const std::optional<PatchPlacement>> placements,
                 int threads, const std::stop_token& stop) {
  if (Status free = matcher.give_back(threads, stop); !free.ok()) return free;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    if (stop.stop_requested()) return cancelled();
    if (placements[i])
      matcher.take(placements[i]->panel, placements[i]->panel_from_artwork * problem.queue[i].match.outline);
  }
  return Ok();
}

}  // namespace veneer::planner
