// The laser on its own: strokes that belong to no job and to no wood of the stock (patterns, cards, drawings).
//
// `confirmed` is what the operator confirms by name before the beam comes on. `who` is for the audit log.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "drivers/laser_job.h"

namespace veneer::daemon {

// Strokes, and what they are called in what is said of them, as in "the drawing is burnt" and "while a drawing was
// burnt".
struct Pattern {
  Pattern(LaserJob its_strokes, std::string its_name = "pattern")  // NOLINT: strokes are one
      : strokes(std::move(its_strokes)), name(std::move(its_name)) {}
  LaserJob strokes;
  std::string name;
};

class PatternCommands {
 public:
  using Reply = std::function<void(Status)>;
  virtual ~PatternCommands() = default;

  // kRefused, naming what is missing, unless all that is to be confirmed is among them (RunnerOptions::confirm and
  // LaserLimits::to_confirm).
  virtual Status require_confirmed(const std::vector<std::string>& confirmed) const = 0;
  // Whether burn_pattern() would be refused once the laser is homed, as far as that is known now: nothing is to move
  // for a pattern that is refused afterwards. Strokes of a laser that was not connected yet are not held against its
  // travel.
  virtual Status may_burn_pattern(const LaserJob& strokes, const std::vector<std::string>& confirmed) const = 0;
  // The same of what the camera sees of the stock; it looks now, and nothing moves.
  virtual void look_for_stock(std::vector<std::string> confirmed, Reply reply) = 0;

  // Reset: the reply comes when the laser is homed and the cell is Idle.
  virtual void home(const std::string& who, Reply reply) = 0;
  // Burns them; only when Idle, and not with a panel of the stock in the camera's sight. The reply comes when they are
  // burnt. Strokes that are all dark need no confirmation and no look.
  // `wanted` is asked before the first stroke, when the camera has looked (which takes up to a minute) and it is on
  // record, and at each Unhold: nothing begins or goes on, with the beam off neither, unless it says Ok.
  virtual void burn_pattern(Pattern pattern, const std::string& who, Reply reply, std::vector<std::string> confirmed,
                            std::function<Status()> wanted) = 0;
  // Lets the controller read them without moving; only when Idle. The reply comes when it has read them.
  virtual void check_pattern(LaserJob&& strokes, const std::string& who, Reply reply) = 0;
};

}  // namespace veneer::daemon
