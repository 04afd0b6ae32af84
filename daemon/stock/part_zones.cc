#include "daemon/stock/part_zones.h"

#include <algorithm>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

Ring<PanelFrame> corners_of(const Box<PanelFrame>& box) {
  return {box.min, {box.max.x, box.min.y}, box.max, {box.min.x, box.max.y}};
}

// Strips are convex, or nearly so: what a straight saw leaves of one is in one piece.
Ring<PanelFrame> largest_ring(const Region<PanelFrame>& region) {
  Ring<PanelFrame> largest;
  for (auto& ring : region.rings())
    if (largest.empty() || signed_area(ring) > signed_area(largest)) largest = ring;
  return largest;
}

}  // namespace

std::vector<db::ZoneRecord> zones_of_part(const std::vector<db::ZoneRecord>& seen,
                                          const std::vector<db::ZoneRecord>& parent,
                                          const Isometry2<PanelFrame, PanelFrame>& part_from_parent,
                                          const Box<PanelFrame>& sheet) {
  const Region<PanelFrame> whole(corners_of(sheet));
  std::vector<db::ZoneRecord> out;
  std::vector<bool> known(seen.size());
  int number = 0;
  for (const db::ZoneRecord& zone : parent) {
    number = std::max(number, zone.number);
    const auto here = intersect(Region<PanelFrame>(part_from_parent * zone.outline), whole);
    bool has_wood = false;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Region<PanelFrame> strip(seen[i].outline);
      if (intersect(here, strip).area() <= strip.area() / 2) continue;
      known[i] = has_wood = true;
    }
    if (has_wood) out.push_back({zone.number, largest_ring(here), zone.material});
  }
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (!known[i]) out.push_back({++number, seen[i].outline, ""});
  return out;
}

}  // namespace veneer::daemon
