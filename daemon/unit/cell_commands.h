// What an operator tells the cell as a whole: the commands of PackML, and what belongs to the panel that waits or is
// being cut.
//
// Every command is refused with a sentence when the state does not allow it. `confirmed` is what the operator confirms
// by name before the beam comes on. `who` is for the audit log.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "daemon/unit/cell_state.h"

namespace veneer::daemon {

class CellCommands {
 public:
  using Reply = std::function<void(Status)>;
  virtual ~CellCommands() = default;

  // The reply comes when the command is accepted and its acting state has begun; Hold's when the machine rests,
  // Unhold's and Unsuspend's when the pose is proven again and motion goes on.
  virtual void command(CellCommand command, const std::string& who, Reply reply,
                       std::vector<std::string> confirmed) = 0;
  // The command Abort by somebody who is asked for only once the laser has its reset byte: to find out who it is may
  // take time and memory.
  virtual void stop_by(const std::function<std::string()>& who) = 0;
  // When the last Abort had been given to the laser: its byte was on its way then. By the steady clock.
  virtual TimePoint stop_given() const = 0;

  virtual void stop_after_piece(const std::string& who, const Reply& reply) = 0;
  // The camera cannot look any more at what was cut last (CellView::owed_look): its pieces are suspect.
  virtual void write_off_look(const std::string& who, const Reply& reply) = 0;
  // Traces the hull of what is about to be cut; only while Suspended with the panel found. Dark when `power` is 0; else
  // the wood under it is written off. The reply comes when it is traced. Nothing is proven by it: Unsuspend looks
  // again.
  virtual void frame(PowerFraction power, const std::string& who, const Reply& reply,
                     const std::vector<std::string>& confirmed) = 0;
};

}  // namespace veneer::daemon
