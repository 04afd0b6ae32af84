#include "daemon/api/sign_in_throttle.h"

#include <algorithm>
#include <iterator>

#include "daemon/api/network.h"

namespace veneer::daemon {

Duration SignInThrottle::wait_of(const Tries& tries, TimePoint now) const {
  Duration wait{0};
  for (const Limit& limit : kLimits) {
    if (tries.size() < limit.tries) continue;
    // Room again once the oldest of the last so many is past.
    const TimePoint again = tries[tries.size() - limit.tries] + limit.in;
    wait = std::max(wait, again - now);
  }
  return wait;
}

void SignInThrottle::forget_old(Book& book, TimePoint now) {
  for (auto of = book.begin(); of != book.end();) {
    Tries& tries = of->second;
    while (!tries.empty() && tries.front() + kLimits.back().in <= now) tries.pop_front();
    of = tries.empty() ? book.erase(of) : std::next(of);
  }
}

std::optional<std::chrono::seconds> SignInThrottle::begin(const std::string& name, const std::string& address) {
  const TimePoint now = clock_.now();
  forget_old(names_, now), forget_old(addresses_, now);
  const std::string network = network_of(address);
  Duration wait{0};
  if (const auto of = names_.find(name); of != names_.end()) wait = std::max(wait, wait_of(of->second, now));
  if (const auto of = addresses_.find(network); of != addresses_.end()) wait = std::max(wait, wait_of(of->second, now));
  if (wait > Duration(0)) return std::chrono::ceil<std::chrono::seconds>(wait);
  if (addresses_.size() >= kMostAddresses && !addresses_.contains(network))
    addresses_.erase(std::ranges::min_element(addresses_, {}, [](const auto& one) { return one.second.back(); }));
  addresses_[network].push_back(now);
  if (!name.empty()) names_[name].push_back(now);
  return std::nullopt;
}

void SignInThrottle::give_back(Book& book, const std::string& key) {
  const auto of = book.find(key);
  if (of == book.end()) return;
  of->second.pop_back();
  if (of->second.empty()) book.erase(of);
}

void SignInThrottle::give_back(const std::string& name, const std::string& address) {
  give_back(names_, name);
  give_back(addresses_, network_of(address));
}

void SignInThrottle::was_right(const std::string& name, const std::string& address) {
  give_back(name, address);
  const std::string network = network_of(address);
  std::erase(known_, network);
  known_.push_back(network);
  if (known_.size() > kMostKnown) known_.pop_front();
}

bool SignInThrottle::knows(const std::string& address) const {
  return is_of_this_machine(address) || std::ranges::count(known_, network_of(address)) > 0;
}

}  // namespace veneer::daemon
