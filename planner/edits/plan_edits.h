// What a person changes about a plan before it is planned again.
//
// A plan is kept by handing its pieces to PlanOptions::kept; what is not handed over is planned anew, in the same
// patches and under the same marks. Pure functions; errors (kNotFound, kInvalidArgument) name the piece or panel.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner {

struct ForbiddenWood {
  PanelId panel;
  Box<PanelFrame> region;
};
// "P-0001,10,20,5,5": panel, left, bottom, width and height in millimetres; the id may hold commas itself.
Result<ForbiddenWood> forbidden_wood(const std::string& text);

// Takes a rectangle of wood out of what is free: a knot, a stain.
Status forbid(std::span<StockPanel> stock, const PanelId& panel, const Box<PanelFrame>& region);

// Two pieces change places: each lies centred where the other lay, turned like it.
Status swap_pieces(Plan& plan, const std::string& one, const std::string& other);

// The piece goes to one of its listed alternatives, counted from 1.
Status take_alternative(Plan& plan, const std::string& mark, std::size_t number);

// The pieces of a plan, as PlanOptions::kept wants them; `must`: the marks of those that must stay. With kOnly all
// others lose their wood, with kAll those of `replanned`.
enum class Keep { kAll, kOnly };
Result<std::vector<KeptPiece>> kept_pieces(const Plan& plan, Keep keep, std::span<const std::string> must,
                                           std::span<const std::string> replanned);

// What is asked of an earlier plan, by marks.
struct PlanEdits {
  std::vector<std::string> pins;       // keep these only; none: keep all
  std::vector<std::string> replanned;  // plan these anew
  std::vector<std::pair<std::string, std::string>> swaps;
  std::vector<std::pair<std::string, std::size_t>> takes;  // mark, number of its alternative
  bool held = false;  // the plan is being made: what is not planned anew has its wood already, or is cut
};
// Moves pieces of `plan` and hands it over as PlanOptions::kept; what was moved, pinned or is held must stay. Pieces of
// several sizes are understood without saying again how many there were, curved ones keep their shapes (such a plan is
// not refined again), and all keep their marks, short ones or not.
Status keep_edited(Plan plan, const PlanEdits& edits, PlanOptions& options);

}  // namespace veneer::planner
