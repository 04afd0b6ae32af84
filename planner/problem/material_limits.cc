#include "planner/problem/material_limits.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {

MaterialLimits::MaterialLimits(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                               const std::vector<MaterialLimit>& limits)
    : limits_(limits) {
  if (limits.empty()) return;
  for (const Artwork& artwork : artworks) whole_ += artwork.width * artwork.height;
  for (const StockPanel& panel : stock) {
    Panel& out = panels_.emplace_back();
    const Point<PanelFrame> low = panel.free.origin;
    const Point<PanelFrame> high{low.x + panel.free.width(), low.y + panel.free.height()};
    out.outline = {low, {high.x, low.y}, high, {low.x, high.y}};
    if (panel.zones.empty()) out.number = number_of(panel.material);
    for (const WoodZone& zone : panel.zones)
      if (const int number = number_of(zone.material); number != kNone)
        out.zones.push_back({number, zone.outline, Region<PanelFrame>(zone.outline)});
  }
}

int MaterialLimits::number_of(const std::string& material) const {
  const auto found = std::ranges::find(limits_, material, &MaterialLimit::material);
  return found == limits_.end() ? kNone : static_cast<int>(found - limits_.begin());
}

int MaterialLimits::at(int panel, const Point<PanelFrame>& middle) const {
  if (limits_.empty()) return kNone;
  const Panel& of = panels_[static_cast<std::size_t>(panel)];
  const auto zone = std::ranges::find_if(of.zones, [&](const Zone& it) { return it.region.contains(middle); });
  return zone == of.zones.end() ? of.number : zone->number;
}

std::vector<MaterialLimits::Wood> MaterialLimits::wood_under(int number) const {
  std::vector<Wood> out;
  for (std::size_t p = 0; p < panels_.size(); ++p) {
    if (panels_[p].number == number) out.push_back({static_cast<int>(p), panels_[p].outline});
    for (const Zone& zone : panels_[p].zones)
      if (zone.number == number) out.push_back({static_cast<int>(p), zone.outline});
  }
  return out;
}

SquareMillimetres area_of(const Ring<ArtworkFrame>& outline) {
  return SquareMillimetres(std::abs(signed_area(outline)));
}

Point<ArtworkFrame> middle_of(const Ring<ArtworkFrame>& outline) {
  const Box<ArtworkFrame> box = bounds(outline);
  return {(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2};
}

}  // namespace veneer::planner
