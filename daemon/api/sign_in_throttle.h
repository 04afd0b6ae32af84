// How often a password may be tried: 3 times a minute, 5 in ten minutes, 10 an hour, for each name and for each address
// (network.h) alike. A try counts from its beginning, so that many at once are no way round; one that was right is
// given back, and its address known from then on.
//
// Bound to the reactor.
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "base/clock.h"

namespace veneer::daemon {

class SignInThrottle {
 public:
  struct Limit {
    std::size_t tries;
    std::chrono::seconds in;
  };
  static constexpr std::array<Limit, 3> kLimits = {
      Limit{3, std::chrono::minutes(1)}, Limit{5, std::chrono::minutes(10)}, Limit{10, std::chrono::hours(1)}};
  // Addresses that are remembered; beyond that the one that has been quiet for longest is forgotten. Names are those of
  // users, and few.
  static constexpr std::size_t kMostAddresses = 1024;
  // Addresses that are known. Whoever makes one known has a password, so that strangers cannot make others forgotten.
  static constexpr std::size_t kMostKnown = 64;

  // `clock` is real time and outlives this.
  explicit SignInThrottle(const Clock& clock) : clock_(clock) {}

  // nullopt: the try counts, and may go on. Else how long to wait; then it does not count. `name` is a user's; "" when
  // nobody has it, and only the address counts.
  std::optional<std::chrono::seconds> begin(const std::string& name, const std::string& address);
  // The last one was not looked at.
  void give_back(const std::string& name, const std::string& address);
  // The last one was right.
  void was_right(const std::string& name, const std::string& address);
  // Somebody has signed in from there since the daemon began, or it is this machine's own.
  bool knows(const std::string& address) const;

 private:
  using Tries = std::deque<TimePoint>;  // oldest first
  Duration wait_of(const Tries& tries, TimePoint now) const;
  using Book = std::map<std::string, Tries>;
  static void forget_old(Book& book, TimePoint now);
  static void give_back(Book& book, const std::string& key);

  const Clock& clock_;
  Book names_, addresses_;
  std::deque<std::string> known_;  // networks; the one that was right last is the last
};

}  // namespace veneer::daemon
