// Whose request is looked at next. The loop that answers STOP looks at one request at a time, and between two of them
// at whatever else is ready: however many connections send whatever is costly to read, STOP waits for one of them.
//
// Bound to the reactor.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>

namespace veneer::daemon {

class Turns {
 public:
  using Turn = std::function<void()>;

  void wait(const std::string& identity, Turn turn);
  bool empty() const { return lines_.empty(); }
  // Takes out the next one: identities go round, and within one who came first. REQUIRES: !empty()
  Turn next();

 private:
  struct Line {
    std::deque<Turn> turns;
    std::uint64_t last = 0;  // counted by `taken_`
  };
  std::map<std::string, Line> lines_;  // by identity; none is empty
  std::uint64_t taken_ = 0;
};

}  // namespace veneer::daemon
