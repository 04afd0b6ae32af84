// An operator's word that something is to be burnt on the laser alone: it stands for the homing before it as well, and
// does not outlast the lid, the cell's state, nor its task.
//
// Bound to the reactor. `unit` and `patterns` outlive the task.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/api/tasks.h"
#include "daemon/unit/pattern_commands.h"
#include "daemon/unit/unit_state.h"

namespace veneer::daemon {

// As it was given.
struct PatternWord {
  std::string who;
  std::vector<std::string> confirmed;  // by name
  bool burns = true;                   // false: with the beam off
  Consent given;                       // when it was asked for
};

// kConflict where a Reset is not possible and the cell is not Idle.
Status may_home(const UnitState& unit);
Status not_cancelled(const TaskReporter& task);  // kCancelled once its stop is requested
// Homes the laser first unless the cell is Idle, then goes on; an operator's command must stand behind it. A task that
// was cancelled homes nothing.
void when_homed(const UnitState& unit, PatternCommands& patterns, const TaskReporter& task, const std::string& who,
                std::function<void()> then);

// What is refused of strokes that are to be burnt, as far as it can be known before the machine homes for nothing.
// Without strokes, of a laser that was never there, what does not depend on them.
Status may_begin_pattern(const UnitState& unit, const PatternCommands& patterns, const LaserJob& strokes,
                         const PatternWord& word);
// Looks and homing take their time: kCancelled, or kRefused, once the word does not hold any more.
Status still_wanted(const UnitState& unit, const TaskReporter& task, const Consent& given);
// As when_homed(), for strokes that are burnt then: nothing is homed where wood of the stock may lie on the bed.
// `homed` is what the word stands on afterwards; a lid that was opened meanwhile ends the task.
void home_for_pattern(const UnitState& unit, PatternCommands& patterns, const TaskReporter& task,
                      const PatternWord& word, std::function<void(const Consent& homed)> then);

}  // namespace veneer::daemon
