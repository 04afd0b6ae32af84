// One-time links that make one browser an operator, and the sessions they open. Without accounts this is the only way
// to more than viewing over TCP.
//
// Bound to the reactor. Tokens are 256 random bits from OpenSSL and compared in constant time.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/result.h"

namespace veneer::daemon {

class ConsoleLinks {
 public:
  static constexpr std::chrono::minutes kLinkLife{5};
  static constexpr std::chrono::hours kSessionLife{12};
  static constexpr std::size_t kMaxLinks = 16;     // the oldest go first
  static constexpr std::size_t kMaxSessions = 16;  // the oldest go first

  // `clock` is real time and outlives this.
  explicit ConsoleLinks(const Clock& clock) : clock_(clock) {}

  // A token good for one visit within kLinkLife. `maker` is who asked for it.
  Result<std::string> new_link(const std::string& maker);
  struct Session {
    std::string secret, who;
  };
  // Uses the token up and opens a session; kRefused when it is unknown, used or too old.
  Result<Session> redeem(std::string_view token);
  // "console link 3 of uid 1000", for the audit; nullopt when no open session has this secret.
  std::optional<std::string> who_has(std::string_view secret) const;

 private:
  struct Secret {
    std::string value;
    TimePoint expires;
    std::string who;
  };
  static const Secret* find(const std::vector<Secret>& secrets, std::string_view value);
  void forget_expired(std::vector<Secret>& secrets) const;

  const Clock& clock_;
  int last_link_ = 0;
  std::vector<Secret> links_;
  std::vector<Secret> sessions_;
};

}  // namespace veneer::daemon
