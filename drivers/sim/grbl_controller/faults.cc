#include "drivers/sim/grbl_controller/faults.h"

#include <array>
#include <string>
#include <utility>

namespace veneer::sim {

Result<FaultKind> fault_kind(std::string_view name) {
  using K = FaultKind;
  static constexpr std::array<std::pair<std::string_view, K>, 11> kNames{{{"drop_ok", K::kDropOk},
                                                                          {"duplicate_ok", K::kDuplicateOk},
                                                                          {"garble_byte", K::kGarbleByte},
                                                                          {"drop_byte", K::kDropByte},
                                                                          {"fuse_lines", K::kFuseLines},
                                                                          {"stall", K::kStall},
                                                                          {"unplug", K::kUnplug},
                                                                          {"banner", K::kBanner},
                                                                          {"error", K::kError},
                                                                          {"alarm", K::kAlarm},
                                                                          {"slip", K::kSlip}}};
  std::string known;
  for (const auto& [text, kind] : kNames) {
    if (text == name) return kind;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  return Error{ErrorCode::kNotFound, "the laser knows no fault '" + std::string(name) + "'; it knows " + known};
}

}  // namespace veneer::sim
