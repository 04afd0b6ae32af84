#include "tests/support/fault_link.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace veneer::tests {
namespace {

Duration seconds_of(double s) { return Duration(static_cast<Duration::rep>(s * 1e9)); }

// A line GRBL would take: every letter once, every letter with a number.
bool valid_line(std::string_view line) {
  std::set<char> letters;
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] < 'A' || line[i] > 'Z' || !letters.insert(line[i]).second) return false;
    std::size_t digits = 0, points = 0, end = i + 1;
    if (end < line.size() && line[end] == '-') ++end;
    for (; end < line.size() && ((line[end] >= '0' && line[end] <= '9') || line[end] == '.'); ++end)
      ++(line[end] == '.' ? points : digits);
    if (digits == 0 || points > 1) return false;
    i = end;
  }
  return !letters.empty();
}

}  // namespace

FaultLink::FaultLink(std::uint64_t seed) : random_(seed) {
  bench.controller.power_on(bench.clock.now());
  bench.controller.take_output();
}

void FaultLink::connect_and_home() {
  core.connect(now());
  exchange();
  run(5);
  core.home(now());
  exchange();
  run(120, [this] { return !all<laser_event::Homed>().empty(); });
  events.clear();
}

void FaultLink::arm(WireFault kind, std::size_t after) {
  armed_ = kind;
  countdown_ = after;
  in_pieces_ = kind == WireFault::kPartialWrites;
  cannot_drop_ = random_() % 2 == 0;
}

TimePoint FaultLink::next_arrival() const {
  TimePoint next = TimePoint::max();
  for (const auto* way : {&to_controller_, &to_core_})
    if (!way->empty()) next = std::min(next, std::max(way->front().at, stalled_until_));
  return next;
}

void FaultLink::run(double seconds, const std::function<bool()>& until) {
  const TimePoint end = now() + seconds_of(seconds);
  while (now() < end && !(until && until())) {
    TimePoint next = std::min({end, core.next_deadline(), next_arrival()});
    if (const auto event = bench.controller.next_event_time()) next = std::min(next, *event);
    if (next > now()) bench.clock.advance(next - now());
    bench.controller.advance_to(now());
    exchange();
    core.tick(now());
    exchange();
    if (on_step) on_step();
    if (next == end) return;
  }
}

void FaultLink::exchange() {
  for (bool moved = true; moved;) {
    moved = false;
    const grbl::GrblOutput output = core.take_output();
    longest_queue_s = std::max(longest_queue_s, core.queued_motion_s());
    if (!output.urgent.empty()) {
      // What the host has not written yet is dropped; what the adapter already has may follow all the same.
      if (!cannot_drop_) to_controller_.clear();
      send(output.urgent);
    }
    if (!output.bytes.empty()) send(output.bytes);
    for (LaserEvent& event : core.take_events()) events.push_back(std::move(event));
    while (!to_controller_.empty() && std::max(to_controller_.front().at, stalled_until_) <= now()) {
      const std::string bytes = std::move(to_controller_.front().bytes);
      to_controller_.pop_front();
      bench.controller.receive(bytes, now());
      moved = true;
    }
    std::string answer = bench.controller.take_output();
    if (!answer.empty() && !link_down_) {
      if (armed_ == WireFault::kGarbledAnswer && countdown_ <= answer.size() && !fired_) {
        answer[countdown_ - 1] = static_cast<char>(33 + random_() % 94);
        fired_ = true;
      } else if (armed_ == WireFault::kGarbledAnswer && !fired_) {
        countdown_ -= answer.size();
      }
      to_core_.push_back({now(), std::move(answer)});
    }
    while (!to_core_.empty() && std::max(to_core_.front().at, stalled_until_) <= now()) {
      const std::string bytes = std::move(to_core_.front().bytes);
      to_core_.pop_front();
      core.receive(bytes, now());
      moved = true;
    }
  }
}

void FaultLink::send(std::string bytes) {
  if (link_down_) return;
  sent_ += bytes.size();
  if (armed_ && !fired_ && armed_ != WireFault::kGarbledAnswer) bytes = damaged(std::move(bytes));
  if (link_down_) return;
  if (!in_pieces_) return to_controller_.push_back({now(), std::move(bytes)});
  TimePoint at = to_controller_.empty() ? now() : std::max(now(), to_controller_.back().at);
  while (!bytes.empty()) {
    const std::size_t piece = std::min<std::size_t>(bytes.size(), 1 + random_() % 16);
    at += seconds_of(static_cast<double>(random_() % 30) * 1e-3);
    to_controller_.push_back({at, bytes.substr(0, piece)});
    bytes.erase(0, piece);
  }
}

std::string FaultLink::damaged(std::string bytes) {
  if (countdown_ > bytes.size() && !truncating_) {
    countdown_ -= bytes.size();
    return bytes;
  }
  std::size_t at = truncating_ ? 0 : countdown_ - 1;
  countdown_ = 1;  // a fault that finds nothing here waits for the next write
  const auto next_newline = bytes.find('\n', at);
  switch (*armed_) {
    case WireFault::kGarbledByte:
      bytes[at] = static_cast<char>(33 + random_() % 94);
      break;
    case WireFault::kNoise:
      for (std::uint64_t n = 1 + random_() % 8; n > 0; --n) {
        // No reset: a byte that only stops the machine proves nothing.
        char c = static_cast<char>(random_() % 256);
        if (c == '\x18') c = '\n';
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), c);
      }
      break;
    case WireFault::kDroppedByte:
      bytes.erase(at, 1);
      break;
    case WireFault::kTruncatedLine:
      if (next_newline == std::string::npos || next_newline == at) return bytes;
      bytes.erase(at, next_newline - at);
      break;
    case WireFault::kFusedLines:
      if (next_newline == std::string::npos) return bytes;
      bytes.erase(next_newline, 1);
      break;
    case WireFault::kFusedValid: {
      std::string fused = fused_valid(bytes, at);
      if (fused == bytes) return bytes;
      bytes = std::move(fused);
      break;
    }
    case WireFault::kLinkStall:
      stalled_until_ = now() + seconds_of(0.1 * std::pow(600.0, static_cast<double>(random_() % 1001) / 1000));
      break;
    case WireFault::kIoError:
    case WireFault::kReplug:
      bytes.erase(at);
      if (*armed_ == WireFault::kIoError || random_() % 2 == 0) to_controller_.push_back({now(), bytes});
      lose_link();
      break;
    default:
      break;
  }
  fired_ = true;
  return bytes;
}

// Two lines that follow each other lose some bytes around the newline between them, and what is left is a valid line.
std::string FaultLink::fused_valid(const std::string& bytes, std::size_t from) {
  for (std::size_t end = bytes.find('\n', from); end != std::string::npos; end = bytes.find('\n', end + 1)) {
    const std::size_t start = end == 0 ? 0 : bytes.rfind('\n', end - 1) + 1;
    const std::size_t after = bytes.find('\n', end + 1);
    if (after == std::string::npos) break;
    std::vector<std::string> candidates;
    for (std::size_t a = start; a <= end; ++a) {
      for (std::size_t b = end + 1; b <= after; ++b) {
        std::string line = bytes.substr(start, a - start) + bytes.substr(b, after - b);
        if (valid_line(line)) candidates.push_back(bytes.substr(0, start) + line + bytes.substr(after));
      }
    }
    if (!candidates.empty()) return candidates[random_() % candidates.size()];
  }
  return bytes;
}

void FaultLink::lose_link() {
  if (std::exchange(link_down_, true)) return;
  for (const Parcel& parcel : to_controller_) bench.controller.receive(parcel.bytes, now());
  to_controller_.clear();
  to_core_.clear();
  bench.controller.unplug(now());
  core.link_lost({ErrorCode::kDisconnected, "the link is gone"}, now());
}

void FaultLink::plug() {
  link_down_ = false;
  stalled_until_ = {};
  in_pieces_ = false;
  to_controller_.clear();
  to_core_.clear();
  bench.controller.take_output();
  bench.controller.plug();
}

}  // namespace veneer::tests
