// What the CH341 and the board's receiver do with transfers.
#include <algorithm>
#include <string>
#include <utility>

#include "drivers/sim/lihuiyu_board/lihuiyu_board.h"

namespace veneer::sim {
namespace {

constexpr std::size_t kPacket = 34, kPayload = 30, kChunk = 32;
constexpr unsigned char kWriteData = 0xA6, kAskStatus = 0xA0;
constexpr std::uint8_t kOut = 0x02, kIn = 0x82;

unsigned char byte(std::string_view bytes, std::size_t i) { return static_cast<unsigned char>(bytes[i]); }

// CRC-8 of 1-Wire, most significant bit first on bytes and result turned round: not the way the driver does it.
unsigned char turned(unsigned char c) {
  unsigned char out = 0;
  for (int i = 0; i < 8; ++i) out = static_cast<unsigned char>((out << 1) | ((c >> i) & 1));
  return out;
}
unsigned char checksum(std::string_view payload) {
  unsigned crc = 0;
  for (const char c : payload) {
    crc ^= turned(static_cast<unsigned char>(c));
    for (int i = 0; i < 8; ++i) crc = ((crc << 1) ^ ((crc & 0x80) != 0 ? 0x31U : 0U)) & 0xFF;
  }
  return turned(static_cast<unsigned char>(crc));
}

bool only_filling(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c == 'F'; });
}

bool is_for_packets(BoardFaultKind kind) {
  return kind != BoardFaultKind::kLoseStatus && kind != BoardFaultKind::kRepeatStatus &&
         kind != BoardFaultKind::kGarbleStatus;
}

}  // namespace

LihuiyuBoard::Answer LihuiyuBoard::setup(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                                         std::uint16_t index) {
  if (!plugged_) return Answer::kError;
  if (request_type == 0x40 && request == 0xB1 && index == 0) epp_ = value == 0x0102;
  return Answer::kTaken;
}

LihuiyuBoard::Answer LihuiyuBoard::write(std::uint8_t endpoint, std::string_view bytes, TimePoint now) {
  advance_to(now);
  if (!plugged_) return Answer::kError;
  if (endpoint != kOut || bytes.empty()) return Answer::kError;
  if (byte(bytes, 0) == kAskStatus) {
    answer_status();
    return Answer::kTaken;
  }
  if (deaf_) return Answer::kNotYet;
  // In another mode the chip talks to pins nobody listens to.
  if (!epp_) return Answer::kTaken;
  const Answer answer = take_packet(bytes, now);
  plan();
  return answer;
}

std::optional<std::string> LihuiyuBoard::read(std::uint8_t endpoint, std::size_t most, TimePoint now) {
  advance_to(now);
  if (!plugged_ || endpoint != kIn || replies_.empty()) return std::nullopt;
  std::string bytes = std::move(replies_.front());
  replies_.pop_front();
  bytes.resize(std::min(bytes.size(), most));
  return bytes;
}

void LihuiyuBoard::transfer_given_up() { deaf_ = false; }

void LihuiyuBoard::plug() {
  if (plugged_) return;
  plugged_ = true;
  epp_ = deaf_ = false;
  replies_.clear();
  ++enumeration_;
}

void LihuiyuBoard::unplug() { plugged_ = false; }

std::optional<BoardFault> LihuiyuBoard::take_fault(bool packet) {
  for (auto fault = faults_.begin(); fault != faults_.end(); ++fault) {
    if (is_for_packets(fault->kind) != packet || --fault->after > 0) continue;
    const BoardFault due = *fault;
    faults_.erase(fault);
    return due;
  }
  return std::nullopt;
}

LihuiyuBoard::Answer LihuiyuBoard::take_packet(std::string_view sent, TimePoint now) {
  // A transfer that waits is tried again; the fault's moment is when it could be taken.
  if (!powered_ || booting_until_ || hangs() || buffer_.size() >= options_.buffer_packets) return Answer::kNotYet;
  ++log_.packets;
  std::string bytes(sent);
  if (const auto fault = take_fault(true)) {
    const Answer answer = apply_fault(*fault, bytes, now);
    if (answer != Answer::kTaken || bytes.empty()) return answer;
  }
  const bool whole = bytes.size() == kPacket && byte(bytes, 0) == kWriteData && byte(bytes, 1) == 0 &&
                     byte(bytes, kChunk) == kWriteData;
  const std::string payload = whole ? bytes.substr(2, kPayload) : std::string();
  if (!whole || checksum(payload) != byte(bytes, kPacket - 1)) {
    rejected_ = true;
    ++log_.rejected;
    return Answer::kTaken;
  }
  accept(payload);
  return deaf_ ? Answer::kNotYet : Answer::kTaken;
}

LihuiyuBoard::Answer LihuiyuBoard::apply_fault(const BoardFault& fault, std::string& bytes, TimePoint now) {
  const Duration value = std::chrono::milliseconds(fault.value);
  switch (fault.kind) {
    case BoardFaultKind::kRejectPacket:
      bytes[2 + random_() % kPayload] ^= static_cast<char>(1 << random_() % 8);
      if (fault.value > 1) faults_.push_front({fault.kind, 1, fault.value - 1});
      return Answer::kTaken;
    case BoardFaultKind::kTruncatePacket:
      bytes.resize(1 + random_() % (bytes.size() - 1));
      return Answer::kTaken;
    case BoardFaultKind::kLosePacket:
      deaf_ = true;
      return Answer::kNotYet;
    case BoardFaultKind::kLosePacketReply:
      deaf_ = true;
      return Answer::kTaken;
    case BoardFaultKind::kBusyForever:
      locked_ = true;
      return Answer::kNotYet;
    case BoardFaultKind::kStall:
      stalled_until_ = now + value;
      return Answer::kNotYet;
    case BoardFaultKind::kUnplug:
      unplug();
      return Answer::kError;
    case BoardFaultKind::kReplug:
      unplug();
      replug_at_ = now + value;
      return Answer::kError;
    case BoardFaultKind::kTransferError:
      return Answer::kError;
    case BoardFaultKind::kBrownOut:
      fail_supply(now);
      supply_back_at_ = now + value;
      return Answer::kNotYet;
    case BoardFaultKind::kOpenLid:
      set_lid(true, now);
      return powered_ ? Answer::kTaken : Answer::kNotYet;
    case BoardFaultKind::kLoseStatus:
    case BoardFaultKind::kRepeatStatus:
    case BoardFaultKind::kGarbleStatus:
      break;
  }
  return Answer::kTaken;
}

void LihuiyuBoard::accept(const std::string& payload) {
  rejected_ = finished_ = accepted_at_ = false;
  const std::string_view text = payload;
  if (text[0] == 'I' && only_filling(text.substr(1))) return stop_dead();
  if (text.substr(0, 2) == "PN" && only_filling(text.substr(2))) {
    paused_ = !paused_;
    return;
  }
  if (options_.m3 && text.substr(0, 3) == "AT1") {
    power_permille_ = std::min(1000, byte(text, 3) * 254 + byte(text, 4));
    accepted_at_ = true;
    return;
  }
  buffer_.push_back({payload, motion_time_});
}

void LihuiyuBoard::answer_status() {
  const auto fault = take_fault(false);
  if (fault && fault->kind == BoardFaultKind::kLoseStatus) return;
  std::string status{'\xFF', static_cast<char>(lines()), '\x6F', '\x08', '\x13', '\0'};
  if (fault && fault->kind == BoardFaultKind::kGarbleStatus) {
    status.resize(random_() % 9);
    for (char& c : status) c = static_cast<char>(random_());
  }
  replies_.push_back(status);
  if (fault && fault->kind == BoardFaultKind::kRepeatStatus) replies_.push_back(status);
}

// The lines as levels. Without supply they float high.
std::uint8_t LihuiyuBoard::lines() const {
  if (!powered_ || booting_until_) return 0xEF;
  if (accepted_at_) return 0xCC;
  std::uint8_t lines = 0xCE;
  const bool busy = locked_ || homing_ || buffer_.size() >= options_.buffer_packets;
  if (busy) lines |= 0x20;
  if (rejected_ && !busy) lines |= 0x01;
  if (finished_) lines = 0xEC;
  return lines;
}

}  // namespace veneer::sim
