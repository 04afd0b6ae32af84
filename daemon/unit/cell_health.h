// Whether the parts that must answer do, and the end of what moves when they do not: beam off, one sentence, and the
// daemon lives on. A stuck reactor never gets here; that one is the service manager's business (daemon/api/watchdog.h).
//
// Healthy means: the database's thread has answered the last question within `patience`, and whenever the unit may be
// moving, the laser's link is up. Nothing is stopped while the cell is at rest: a laser may be switched off then.
// Bound to the reactor.
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
    // Ends what moves, beam off first; told why.
    std::function<void(const std::string& sentence)> stop;
  };
  CellHealth(const Clock& real_clock, Parts parts, Duration patience = std::chrono::seconds(10));
  ~CellHealth();

  // Looks, stops what moves when somebody does not answer, and asks the next question. To be called once a second.
  void look();
  // What is wrong; "" while all answer.
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
