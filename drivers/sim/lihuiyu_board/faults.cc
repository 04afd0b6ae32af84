#include "drivers/sim/lihuiyu_board/faults.h"

#include <array>
#include <string>
#include <utility>

namespace veneer::sim {

Result<BoardFaultKind> board_fault_kind(std::string_view name) {
  using K = BoardFaultKind;
  static constexpr std::array<std::pair<std::string_view, K>, 14> kNames{{{"reject_packet", K::kRejectPacket},
                                                                          {"truncate_packet", K::kTruncatePacket},
                                                                          {"lose_packet", K::kLosePacket},
                                                                          {"lose_packet_reply", K::kLosePacketReply},
                                                                          {"lose_status", K::kLoseStatus},
                                                                          {"repeat_status", K::kRepeatStatus},
                                                                          {"garble_status", K::kGarbleStatus},
                                                                          {"busy_forever", K::kBusyForever},
                                                                          {"stall", K::kStall},
                                                                          {"unplug", K::kUnplug},
                                                                          {"replug", K::kReplug},
                                                                          {"transfer_error", K::kTransferError},
                                                                          {"brown_out", K::kBrownOut},
                                                                          {"open_lid", K::kOpenLid}}};
  std::string known;
  for (const auto& [text, kind] : kNames) {
    if (text == name) return kind;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  return Error{ErrorCode::kNotFound, "the laser knows no fault '" + std::string(name) + "'; it knows " + known};
}

}  // namespace veneer::sim
