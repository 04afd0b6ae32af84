#include "cli/plan_edits.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <optional>
#include <utility>

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

Result<planner::PlanEdits> edits_of(const EditArguments& arguments) {
  planner::PlanEdits edits{arguments.pins, arguments.replanned, {}, {}};
  for (const std::string& swap : arguments.swaps) {
    const std::size_t comma = swap.find(',');
    if (comma == std::string::npos) return unusable(fmt::format("--swap {} is not MARK,MARK", swap));
    edits.swaps.emplace_back(swap.substr(0, comma), swap.substr(comma + 1));
  }
  for (const std::string& take : arguments.takes) {
    const std::size_t equals = take.find('=');
    const auto wanted = equals == std::string::npos ? std::nullopt : number(take.substr(equals + 1));
    if (!wanted || *wanted < 1 || *wanted > 1e6 || *wanted != std::floor(*wanted))
      return unusable(fmt::format("--take {} is not MARK=NUMBER", take));
    edits.takes.emplace_back(take.substr(0, equals), static_cast<std::size_t>(*wanted));
  }
  return edits;
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
  add_forbid_argument(command, arguments);
}

void add_forbid_argument(CLI::App& command, EditArguments& arguments) {
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
  const auto edits = edits_of(arguments);
  if (!edits.ok()) return edits.error();
  return planner::keep_edited(std::move(*plan), *edits, options);
}

}  // namespace veneer::cli
