#include "planner/poses/admission.h"

#include "planner/cancelled.h"

namespace veneer::planner {

Result<std::vector<bool>> admitted(const PlacedOutlines& wished, const PlacedOutlines& before,
                                   const std::vector<MatchPanel>& panels, const std::stop_token& stop) {
  const std::size_t count = wished.size();
  std::vector<bool> moves(count);
  for (std::size_t i = 0; i < count; ++i) moves[i] = wished[i] != before[i];
  // Who goes back may lie in the way of others that have moved: each time at least one more stays.
  for (bool anew = true; anew;) {
    anew = false;
    std::vector<FreeWood> wood;
    wood.reserve(panels.size());
    for (const MatchPanel& panel : panels) wood.push_back(panel.wood.untouched());
    for (std::size_t i = 0; i < count; ++i) {
      if (stop.stop_requested()) return cancelled();
      if (!moves[i] && before[i]) wood[static_cast<std::size_t>(before[i]->panel)].allocate(before[i]->outline);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (stop.stop_requested()) return cancelled();
      if (!moves[i] || !wished[i]) continue;
      FreeWood& there = wood[static_cast<std::size_t>(wished[i]->panel)];
      if (there.admits(wished[i]->outline))
        there.allocate(wished[i]->outline);
      else
        moves[i] = false, anew = true;
    }
  }
  return moves;
}

}  // namespace veneer::planner
