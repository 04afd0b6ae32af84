// What crosses the wire between the cell and a Lihuiyu board's CH341 chip.
//
// The chip's bridge must be put into EPP mode once. A packet is 34 bytes in one bulk transfer to endpoint 0x02:
//
//   A6 00  30 bytes of payload  A6 crc
//
// A6 tells the chip to write what follows, up to 31 bytes, to the board; so the board sees 00, the payload and the CRC.
// The single byte A0 asks the chip for the levels of its pins, which come back from endpoint 0x82: six bytes, of which
// the second carries the lines the board drives. They are levels, not messages: they hold until the board changes them.
//
// Pure functions; thread-safe.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/usb_transport.h"

namespace veneer::lihuiyu {

inline constexpr std::uint8_t kWriteEndpoint = 0x02, kReadEndpoint = 0x82;

// EPP 1.9: what makes the chip pass packets on.
UsbSetup epp_setup();

// CRC-8 of Dallas/Maxim 1-Wire: polynomial x^8 + x^5 + x^4 + 1, reflected, from 0.
std::uint8_t crc8(std::string_view bytes);

// `payload` of at most 30 bytes, filled up with `fill`: F, which does nothing after the end of a program and outside
// of one, or 0 for the AT commands of M3 boards.
std::string make_packet(std::string_view payload, char fill = 'F');
// A program's text, 30 bytes a packet. A text that ends exactly with a packet is followed by an empty one.
std::vector<std::string> make_packets(std::string_view text);
// M3: sets the power register.
std::string power_packet(int permille);
// Stops, forgets everything, beam off. May be sent again and again.
std::string reset_packet();
// To the limit switches at the upper left.
std::string home_packet();

inline constexpr std::string_view kAskStatus = "\xA0";

// What the board's lines say.
enum class BoardState {
  kReady,     // takes packets
  kBusy,      // its buffer is full
  kRejected,  // the last packet's CRC was wrong
  kFinished,  // a program has ended
  kNoPower,   // the lines float: the laser's own supply is off
};

struct BoardStatus {
  BoardState state = BoardState::kReady;
  std::uint8_t lines = 0;  // as read
  std::string rest;        // the other bytes, the same in every status of one chip
};

// Nothing when these bytes are no status.
std::optional<BoardStatus> parse_status(std::string_view bytes);

}  // namespace veneer::lihuiyu
