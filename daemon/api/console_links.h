// One-time links by which a browser on this machine is signed in without an account. The session that one opens is
// kept with the others (accounts.h).
//
// Bound to the reactor. Tokens are 256 random bits from OpenSSL and compared in constant time.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

class ConsoleLinks {
 public:
  static constexpr std::chrono::minutes kLinkLife{5};
  static constexpr std::size_t kMaxLinks = 16;  // the oldest go first

  // `clock` is real time and outlives this.
  explicit ConsoleLinks(const Clock& clock) : clock_(clock) {}

  // Of an earlier life of the daemon, whose sessions may go on: numbers are used once.
  void count_on_from(int last_link) { last_link_ = last_link; }
  // A token good for one visit within kLinkLife. `maker` is who asked for it.
  Result<std::string> new_link(const std::string& maker, Role role = Role::kOperator);
  // Those that nobody has used; of so many.
  std::size_t forget_unused() { return std::exchange(links_, {}).size(); }
  struct Link {
    std::string who;  // "console link 3 of uid 1000", for the audit
    Role role = Role::kViewer;
  };
  // Uses the token up; kRefused when it is unknown, used or too old.
  Result<Link> redeem(std::string_view token);

 private:
  struct Secret {
    std::string value;
    TimePoint expires;
    Link link;
  };

  const Clock& clock_;
  int last_link_ = 0;
  std::vector<Secret> links_;
};

}  // namespace veneer::daemon
