#include "daemon/api/tls_gate.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace veneer::daemon {
namespace {

constexpr Duration kSecond = std::chrono::seconds(1);

// Beyond the most, those that are remembered for longest go.
void keep_newest(std::map<std::string, TimePoint>& times, std::size_t most) {
  while (times.size() > most)
    times.erase(std::ranges::min_element(times, {}, [](const auto& one) { return one.second; }));
}

}  // namespace

TlsGate::TlsGate(std::size_t turns_a_second)
    : between_turns_(kSecond / static_cast<Duration::rep>(std::max<std::size_t>(turns_a_second, 1))),
      between_connects_(between_turns_ / 2) {}

bool TlsGate::admits(const std::string& network, TimePoint now) {
  forget_old(now);
  TimePoint& used = connects_used_[network];
  used = std::max(used, now);
  if (used + between_connects_ > now + kSecond) return false;
  used += between_connects_;
  keep_newest(connects_used_, kMostNetworks);
  return true;
}

TlsGate::OpenHandshake TlsGate::wait(const std::string& network, Turn turn) {
  if (const auto of = open_->find(network); of != open_->end() && of->second >= kMostOpen) return nullptr;
  ++(*open_)[network];
  waiting_.push_back({network, std::move(turn)});
  return {open_.get(), [open = open_, network](void*) {
            const auto of = open->find(network);
            if (--of->second == 0) open->erase(of);
          }};
}

std::optional<TimePoint> TlsGate::serve(TimePoint now) {
  while (!waiting_.empty()) {
    turns_used_until_ = std::max(turns_used_until_, now);
    const TimePoint due = turns_used_until_ - between_turns_ * static_cast<Duration::rep>(kCloseTogether - 1);
    if (due > now) return due;
    const auto next = std::ranges::min_element(waiting_, {}, [&](const Waiting& one) {
      const auto last = last_turn_.find(one.network);
      return last == last_turn_.end() ? TimePoint::min() : last->second;
    });
    const Waiting served = std::move(*next);
    waiting_.erase(next);
    if (!served.turn()) continue;
    turns_used_until_ += between_turns_;
    last_turn_[served.network] = now;
    keep_newest(last_turn_, kMostNetworks);
  }
  return std::nullopt;
}

void TlsGate::forget_old(TimePoint now) {
  std::erase_if(connects_used_, [now](const auto& one) { return one.second <= now; });
}

}  // namespace veneer::daemon
