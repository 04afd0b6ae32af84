#include "daemon/api/sign_in_throttle.h"

#include <algorithm>
#include <iterator>

namespace veneer::daemon {
namespace {

std::array<std::string, 2> keys_of(const std::string& name, const std::string& address) {
  return {"name " + name, "address " + address};
}

}  // namespace

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

void SignInThrottle::forget_old(TimePoint now) {
  for (auto of = tries_.begin(); of != tries_.end();) {
    Tries& tries = of->second;
    while (!tries.empty() && tries.front() + kLimits.back().in <= now) tries.pop_front();
    of = tries.empty() ? tries_.erase(of) : std::next(of);
  }
}

std::optional<std::chrono::seconds> SignInThrottle::begin(const std::string& name, const std::string& address) {
  const TimePoint now = clock_.now();
  forget_old(now);
  const auto keys = keys_of(name, address);
  Duration wait{0};
  for (const std::string& key : keys)
    if (const auto of = tries_.find(key); of != tries_.end()) wait = std::max(wait, wait_of(of->second, now));
  if (wait <= Duration(0) && tries_.size() + keys.size() > kMostKeys) wait = std::chrono::minutes(1);
  if (wait > Duration(0)) return std::chrono::ceil<std::chrono::seconds>(wait);
  for (const std::string& key : keys) tries_[key].push_back(now);
  return std::nullopt;
}

void SignInThrottle::give_back(const std::string& name, const std::string& address) {
  for (const std::string& key : keys_of(name, address)) {
    const auto of = tries_.find(key);
    if (of == tries_.end()) continue;
    of->second.pop_back();
    if (of->second.empty()) tries_.erase(of);
  }
}

}  // namespace veneer::daemon
