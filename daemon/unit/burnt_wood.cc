#include "daemon/unit/burnt_wood.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "daemon/store/calibration.h"

namespace veneer::daemon {

Result<Region<PanelFrame>> wood_under(Repositories& repositories, const ProvenPose& pose,
                                      const Polyline<MachineFrame>& path, Millimetres reach, const std::string& now) {
  const auto calibration = load_calibration_of_run(repositories, now);
  if (!calibration) return calibration.error();
  if (const Status ready = require_cutting(*calibration); !ready) return ready.error();
  const auto bed_from_machine = calibration->bed->machine_from_bed.inverse();
  const auto panel_from_bed = pose.bed_from_panel.inverse();
  const Millimetres grown{reach.count() + calibration->kerf->count() / 2};
  std::vector<Region<PanelFrame>> parts;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Point<PanelFrame> a = panel_from_bed * (bed_from_machine * path[i > 0 ? i - 1 : 0]),
                            b = panel_from_bed * (bed_from_machine * path[i]);
    // A hair of wood along the way, which is then grown: offsets want an area.
    constexpr double kHair = 0.002;
    const double length = distance(a, b).count();
    const double ux = length > 0 ? (b.x - a.x).count() / length : 1, uy = length > 0 ? (b.y - a.y).count() / length : 0;
    const auto at = [&](const Point<PanelFrame>& p, double along, double aside) {
      return point<PanelFrame>(p.x.count() + ux * along - uy * aside, p.y.count() + uy * along + ux * aside);
    };
    const Ring<PanelFrame> hair{at(a, -kHair, -kHair), at(b, kHair, -kHair), at(b, kHair, kHair), at(a, -kHair, kHair)};
    parts.push_back(offset(Region<PanelFrame>(hair), grown, Corners::kRound));
  }
  return unite(parts);
}

Status write_off_under(Repositories& repositories, const ProvenPose& pose, const Polyline<MachineFrame>& path,
                       const std::vector<PieceId>& own, const std::string& reason, const std::string& at) {
  auto marked = wood_under(repositories, pose, path, Millimetres(0), at);
  if (!marked) return marked.error();
  auto live = repositories.ledger.live_allocations(pose.panel);
  if (!live) return live.error();
  for (const auto& allocation : *live) {
    if (allocation.state == db::AllocationState::kLeased && overlaps(allocation.area, *marked))
      return Error{ErrorCode::kRefused,
                   fmt::format("with power the frame would mark the wood that plan {0} leases: trace it dark, or "
                               "release that with veneerctl job release {0}",
                               allocation.leased_to.value)};
    const bool whole =
        allocation.state == db::AllocationState::kReserved || allocation.state == db::AllocationState::kSuspect;
    if (!whole || std::find(own.begin(), own.end(), allocation.piece) != own.end()) continue;
    if (!overlaps(allocation.area, *marked)) continue;
    const auto piece = repositories.jobs.find_piece(allocation.piece);
    return Error{ErrorCode::kRefused,
                 fmt::format("with power the frame would mark the wood of piece {} of job {}: trace it dark",
                             piece ? piece->mark : "?", allocation.job.value)};
  }
  const auto spoilt = repositories.ledger.write_off_free(pose.panel, *marked, reason, at);
  return spoilt ? Ok() : Status(spoilt.error());
}

}  // namespace veneer::daemon
