// How much of the reactor's time strangers get by coming to the door for other machines. A handshake costs it up to
// some milliseconds, which STOP of the others would wait for. So a handshake waits for its turn once everything it
// needs has come: few turns close together, so many a second, the next one to the network (network.h) whose last turn
// is longest ago. One host that makes many costs nobody else more than one turn. Who connects too often, or has too
// many handshakes open, is turned away at once.
//
// Bound to the reactor; time is what it is told.
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"

namespace veneer::daemon {

class TlsGate {
 public:
  static constexpr std::size_t kCloseTogether = 3;    // turns
  static constexpr std::size_t kMostOpen = 16;        // handshakes of one network: those that wait and those begun
  static constexpr std::size_t kMostNetworks = 1024;  // that are remembered

  // Of one network twice as many may connect within a second as there are turns.
  explicit TlsGate(std::size_t turns_a_second);

  // One has connected from there: may it stay?
  bool admits(const std::string& network, TimePoint now);

  // Kept until the handshake is over; so long it counts as an open one of its network.
  using OpenHandshake = std::shared_ptr<void>;
  // False when nobody is there any more: then it was no turn.
  using Turn = std::function<bool()>;
  // Waits for its turn; nullptr when that network has too many open.
  OpenHandshake wait(const std::string& network, Turn turn);
  // Gives the turns that are due. When to come again; nullopt: nobody waits.
  std::optional<TimePoint> serve(TimePoint now);

 private:
  struct Waiting {
    std::string network;
    Turn turn;
  };
  void forget_old(TimePoint now);

  const Duration between_turns_, between_connects_;
  TimePoint turns_used_until_{};                    // by now, at the even pace
  std::list<Waiting> waiting_;                      // oldest first
  std::map<std::string, TimePoint> last_turn_;      // by network
  std::map<std::string, TimePoint> connects_used_;  // by network, as turns_used_until_
  std::shared_ptr<std::map<std::string, std::size_t>> open_ =
      std::make_shared<std::map<std::string, std::size_t>>();  // an OpenHandshake may outlive this
};

}  // namespace veneer::daemon
