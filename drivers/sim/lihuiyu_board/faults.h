// What can go wrong on a Lihuiyu machine and its wire, one option each. A fault is set, waits for its moment, happens
// once. What USB itself excludes (a transfer acknowledged but lost, or delivered twice) is not among them.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"

namespace veneer::sim {

enum class BoardFaultKind {
  kRejectPacket,     // the after-th packet from now and value - 1 more arrive with a wrong bit
  kTruncatePacket,   // the after-th packet from now arrives cut short
  kLosePacket,       // the after-th packet from now never arrives; the host's transfer is not acknowledged
  kLosePacketReply,  // the after-th packet from now arrives, but the host's transfer is not acknowledged
  kLoseStatus,       // the after-th status from now is never sent
  kRepeatStatus,     // the after-th status from now is sent twice
  kGarbleStatus,     // the after-th status from now is other bytes (drawn from the seed)
  kBusyForever,      // at the after-th packet from now the board locks up: no motion, busy, its beam as it was
  kStall,            // at the after-th packet from now it hangs so for value milliseconds, its lines as they were
  kUnplug,           // at the after-th packet from now the plug is out
  kReplug,           // ... and in again after value milliseconds: another device to the host, the board goes on
  kTransferError,    // the after-th packet from now ends in an error of the host's controller
  kBrownOut,         // at the after-th packet from now the supply fails for value milliseconds
  kOpenLid,          // at the after-th packet from now the lid opens, which cuts the supply
};

struct BoardFault {
  BoardFaultKind kind;
  std::uint64_t after = 1;  // 1 = the next one
  int value = 1;
};

// "reject_packet", "truncate_packet", ... kNotFound names them all.
Result<BoardFaultKind> board_fault_kind(std::string_view name);

}  // namespace veneer::sim
