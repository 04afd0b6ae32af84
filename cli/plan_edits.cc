#include "cli/plan_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <exception>
#include <optional>

#include "planner/edits/plan_edits.h"
#include "planner/files/plan_files.h"

namespace veneer::cli {
namespace {

using planner::Plan;
using planner::StockPanel;

std::optional<double> number(const std::string& text) {
  try {
    std::size_t used = 0;
    const double value = std::stod(text, &used);
    if (used == text.size() && std::isfinite(value)) return value;
  } catch (const std::exception&) {
  }
  return std::nullopt;
}

Status forbid(const std::string& text, std::vector<StockPanel>& stock) {
  const auto wood = planner::forbidden_wood(text);
  if (!wood.ok()) return unusable("--forbid " + wood.error().message);
  return planner::forbid(stock, wood->panel, wood->region);
}

// Moves pieces, and names those that were moved: they stay there.
Result<std::vector<std::string>> move_pieces(const EditArguments& arguments, Plan& plan) {
  std::vector<std::string> moved;
  for (const std::string& swap : arguments.swaps) {
    const std::size_t comma = swap.find(',');
    if (comma == std::string::npos) return unusable(fmt::format("--swap {} is not MARK,MARK", swap));
    const std::string one = swap.substr(0, comma), other = swap.substr(comma + 1);
    if (Status status = planner::swap_pieces(plan, one, other); !status.ok()) return status.error();
    moved.push_back(one), moved.push_back(other);
  }
  for (const std::string& take : arguments.takes) {
    const std::size_t equals = take.find('=');
    const auto wanted = equals == std::string::npos ? std::nullopt : number(take.substr(equals + 1));
    if (!wanted || *wanted < 1 || *wanted > 1e6 || *wanted != std::floor(*wanted))
      return unusable(fmt::format("--take {} is not MARK=NUMBER", take));
    const std::string mark = take.substr(0, equals);
    if (Status status = planner::take_alternative(plan, mark, static_cast<std::size_t>(*wanted)); !status.ok())
      return status.error();
    moved.push_back(mark);
  }
  return moved;
}

}  // namespace

void add_edit_arguments(CLI::App& command, EditArguments& arguments) {
  CLI::Option* keep = command.add_option("--keep", arguments.keep,
                                         "A plan.json of the same pictures in the same patches: its pieces keep their "
                                         "marks, and their places unless an option below moves them");
  command
      .add_option("--pin", arguments.pins,
                  "MARK: keep only the pinned pieces in their places, plan all others anew (repeatable)")
      ->needs(keep);
  command.add_option("--replan", arguments.replanned, "MARK: plan this piece anew (repeatable)")->needs(keep);
  command.add_option("--swap", arguments.swaps, "MARK,MARK: let these two pieces change places (repeatable)")
      ->needs(keep);
  command.add_option("--take", arguments.takes, "MARK=N: move this piece to its N-th alternative (repeatable)")
      ->needs(keep);
  command.add_option(
      "--forbid", arguments.forbidden,
      "PANEL,X,Y,WIDTH,HEIGHT: use no wood there, in mm from the panel's lower left corner (repeatable)");
}

Status apply_edits(const EditArguments& arguments, std::vector<StockPanel>& stock, planner::PlanOptions& options) {
  for (const std::string& text : arguments.forbidden)
    if (Status status = forbid(text, stock); !status.ok()) return status;
  if (arguments.keep.empty()) return Ok();
  Result<Plan> plan = planner::read_plan(arguments.keep);
  if (!plan.ok()) return plan.error();
  Result<std::vector<std::string>> staying = move_pieces(arguments, *plan);
  if (!staying.ok()) return staying.error();
  staying->insert(staying->end(), arguments.pins.begin(), arguments.pins.end());
  const planner::Keep keep = arguments.pins.empty() ? planner::Keep::kAll : planner::Keep::kOnly;
  Result<std::vector<planner::KeptPiece>> kept = planner::kept_pieces(*plan, keep, *staying, arguments.replanned);
  if (!kept.ok()) return kept.error();
  options.kept = std::move(*kept);
  // Pieces of several sizes are understood without saying again how many there were.
  for (const planner::KeptPiece& piece : options.kept)
    options.adaptive_levels =
        std::max(options.adaptive_levels, static_cast<int>(std::bit_width(static_cast<unsigned>(piece.cells))) - 1);
  return Ok();
}

}  // namespace veneer::cli
