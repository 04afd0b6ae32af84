#include "daemon/unit/proven_pose.h"

#include <fmt/format.h>

#include <algorithm>

namespace veneer::daemon {

bool lies_back_up(const ProvenPose& pose) {
  return pose.back_up && pose.bed_from_panel.handedness() == Handedness::kImproper;
}

bool tells_where(const Result<ProvenPose>& look) { return look.ok() || look.error().code == ErrorCode::kNotFound; }

Millimetres moved_between(const ProvenPose& a, const ProvenPose& b) {
  const auto far = point<PanelFrame>(300, 200);  // far from the origin, so that a turn shows as well
  return std::max(distance(a.bed_from_panel * Point<PanelFrame>{}, b.bed_from_panel * Point<PanelFrame>{}),
                  distance(a.bed_from_panel * far, b.bed_from_panel * far));
}

Status require_unmoved(const Result<ProvenPose>& look, const ProvenPose& known, Millimetres tolerance,
                       const char* since) {
  if (!look)
    return Error{look.error().code, fmt::format("the camera cannot tell whether panel {} still lies there ({})",
                                                known.panel.value, look.error().message)};
  if (look->panel != known.panel || !lies_back_up(*look))
    return Error{ErrorCode::kRefused,
                 fmt::format("panel {} no longer lies there back up {}", known.panel.value, since)};
  const Millimetres moved = moved_between(*look, known);
  if (moved > tolerance)
    return Error{ErrorCode::kRefused,
                 fmt::format("panel {} moved by {:.2f} mm {}", known.panel.value, moved.count(), since)};
  return Ok();
}

}  // namespace veneer::daemon
