#include "daemon/routes/pattern_word.h"

#include <fmt/format.h>

#include <utility>

namespace veneer::daemon {

Status may_home(const UnitState& unit) {
  const CellState state = unit.view().state;
  if (state == CellState::kIdle || after(state, CellCommand::kReset)) return Ok();
  return Error{ErrorCode::kConflict,
               fmt::format("the cell is {}, so the laser cannot be homed: {}", to_string(state),
                           state == CellState::kAborted ? "Clear it first" : "end what it is about first")};
}

Status not_cancelled(const TaskReporter& task) {
  if (!task.stop_token().stop_requested()) return Ok();
  return Error{ErrorCode::kCancelled, "it was cancelled before anything was burnt"};
}

void when_homed(const UnitState& unit, PatternCommands& patterns, const TaskReporter& task, const std::string& who,
                std::function<void()> then) {
  if (const Status wanted = not_cancelled(task); !wanted) return task.fail(wanted.error());
  if (unit.view().state == CellState::kIdle) return then();
  task.progress(0.1, "homing the laser");
  patterns.home(who,
                [task, then = std::move(then)](const Status& homed) { homed ? then() : task.fail(homed.error()); });
}

Status may_begin_pattern(const UnitState& unit, const PatternCommands& patterns, const LaserJob& strokes,
                         const PatternWord& word) {
  if (Status given = word.burns ? patterns.require_confirmed(word.confirmed) : Ok(); !given) return given;
  if (Status able = may_home(unit); !able) return able;
  return patterns.may_burn_pattern(strokes, word.confirmed);
}

Status still_wanted(const UnitState& unit, const TaskReporter& task, const Consent& given) {
  const Status wanted = not_cancelled(task);
  return wanted ? unit.still_holds(given) : wanted;
}

void home_for_pattern(const UnitState& unit, PatternCommands& patterns, const TaskReporter& task,
                      const PatternWord& word, std::function<void(const Consent& homed)> then) {
  // A laser that was not connected tells of its lid for the first time when it is homed.
  const bool told_of_the_lid = unit.is_connected();
  const auto home = [&unit, &patterns, task, word, told_of_the_lid, then = std::move(then)] {
    when_homed(unit, patterns, task, word.who, [&unit, task, given = word.given, told_of_the_lid, then] {
      Consent homed = unit.consent();
      if (told_of_the_lid) homed.lid_openings = given.lid_openings;
      if (const Status wanted = still_wanted(unit, task, homed); !wanted) return task.fail(wanted.error());
      then(homed);
    });
  };
  // What is burnt on a laser that is homed already looks by itself, before anything moves.
  if (!word.burns || unit.view().state == CellState::kIdle) return home();
  task.progress(0.05, "looking whether a panel of the stock lies on the bed");
  patterns.look_for_stock(word.confirmed, [&unit, task, given = word.given, home](const Status& clear) {
    // A look that was cancelled may fail as well: then that it was cancelled is what is told.
    if (const Status wanted = still_wanted(unit, task, given); !wanted) return task.fail(wanted.error());
    if (!clear) return task.fail(clear.error());
    home();
  });
}

}  // namespace veneer::daemon
