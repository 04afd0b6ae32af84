#include "drivers/lihuiyu/packet.h"

#include <algorithm>

#include "drivers/lihuiyu/egv_encoder.h"

namespace veneer::lihuiyu {
namespace {

constexpr char kWriteData = '\xA6';
// The lines in a status' second byte.
constexpr std::uint8_t kErrorLine = 0x01, kWorkingLine = 0x02, kBusyLine = 0x20;
constexpr std::uint8_t kOtherLines = 0xDC, kOtherLevels = 0xCC;
constexpr std::size_t kStatusBytes = 6;

}  // namespace

UsbSetup epp_setup() { return {.request_type = 0x40, .request = 0xB1, .value = 0x0102, .index = 0}; }

std::uint8_t crc8(std::string_view bytes) {
  constexpr std::uint8_t kPolynomial = 0x8C;
  std::uint8_t crc = 0;
  for (const char c : bytes) {
    crc ^= static_cast<std::uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint8_t>((crc >> 1) ^ ((crc & 1) != 0 ? kPolynomial : 0));
  }
  return crc;
}

std::string make_packet(std::string_view payload, char fill) {
  std::string filled(payload.substr(0, kPayloadBytes));
  filled.resize(kPayloadBytes, fill);
  std::string packet{kWriteData, '\0'};
  packet += filled;
  packet += kWriteData;
  packet += static_cast<char>(crc8(filled));
  return packet;
}

std::vector<std::string> make_packets(std::string_view text) {
  std::vector<std::string> packets;
  for (std::size_t at = 0; at <= text.size(); at += kPayloadBytes)
    packets.push_back(make_packet(text.substr(at, kPayloadBytes)));
  return packets;
}

std::string power_packet(int permille) {
  constexpr int kBase = 254;
  std::string payload = "AT1";
  payload += static_cast<char>(permille / kBase);
  payload += static_cast<char>(permille % kBase);
  return make_packet(payload, '\0');
}

std::string reset_packet() { return make_packet("I"); }
std::string home_packet() { return make_packet("IPP"); }

std::optional<BoardStatus> parse_status(std::string_view bytes) {
  if (bytes.size() < kStatusBytes) return std::nullopt;
  BoardStatus status;
  status.lines = static_cast<std::uint8_t>(bytes[1]);
  status.rest = std::string(bytes.substr(0, 1)) + std::string(bytes.substr(2));
  if ((status.lines & kOtherLines) != kOtherLevels) return std::nullopt;
  const bool error = (status.lines & kErrorLine) != 0, busy = (status.lines & kBusyLine) != 0;
  if ((status.lines & kWorkingLine) == 0) {
    status.state = BoardState::kFinished;
  } else if (error) {
    status.state = busy ? BoardState::kNoPower : BoardState::kRejected;
  } else {
    status.state = busy ? BoardState::kBusy : BoardState::kReady;
  }
  return status;
}

}  // namespace veneer::lihuiyu
