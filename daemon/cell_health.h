// Whether the parts that must answer do: asked by the watchdog before each feeding, on the reactor (so a stuck reactor
// never gets here).
//
// Healthy means: the database's thread has answered the last question within `patience`, and whenever the unit may be
// moving, the laser's link is up. A laser that is switched off while the cell is at rest is no reason to restart the
// daemon. Bound to the reactor.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"

namespace veneer::daemon {

class CellHealth {
 public:
  struct Parts {
    // Asks the database's thread for a sign of life; the answer comes on the reactor.
    std::function<void(std::function<void()> answered)> ask_database;
    std::function<bool()> moving;      // the unit is in a state in which it may move
    std::function<bool()> laser_link;  // the controller answers
  };
  CellHealth(const Clock& real_clock, Parts parts, Duration patience = std::chrono::seconds(5));
  ~CellHealth();

  // Looks, and asks the next question.
  bool good();
  // Why not; "" while good() says yes.
  const std::string& sentence() const { return sentence_; }

 private:
  const Clock& clock_;
  Parts parts_;
  Duration patience_;
  std::optional<TimePoint> asked_;      // the question that has no answer yet
  std::optional<TimePoint> link_lost_;  // since when it moves without a link
  std::string sentence_;
  std::shared_ptr<bool> alive_;  // answers that come later find out
};

}  // namespace veneer::daemon
