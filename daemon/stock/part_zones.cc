#include "daemon/stock/part_zones.h"

#include <algorithm>
#include <cmath>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

Ring<PanelFrame> corners_of(const Box<PanelFrame>& box) {
  return {box.min, {box.max.x, box.min.y}, box.max, {box.min.x, box.max.y}};
}

Region<PanelFrame> moved(const Region<PanelFrame>& region, const Isometry2<PanelFrame, PanelFrame>& part_from_parent) {
  MicroArea out;
  for (const auto& ring : region.rings()) {
    MicroRing& there = out.rings.emplace_back();
    for (const auto& p : part_from_parent* ring)
      there.push_back({std::llround(p.x.count() * 1000), std::llround(p.y.count() * 1000)});
  }
  return Region<PanelFrame>(micro::unite(out, {}));
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
    const auto here = intersect(moved(zone.shape, part_from_parent), whole);
    bool has_wood = false;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (intersect(here, seen[i].shape).area() <= seen[i].shape.area() / 2) continue;
      known[i] = has_wood = true;
    }
    if (has_wood) out.push_back({zone.number, here, zone.material, zone.confidence});
  }
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (!known[i]) out.push_back({++number, seen[i].shape, "", seen[i].confidence});
  return out;
}

}  // namespace veneer::daemon
