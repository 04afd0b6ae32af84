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
    if (const auto number = number_of(panel.material); number && panel.zones.empty()) out.whole.add(*number);
    for (const WoodZone& zone : panel.zones)
      if (const auto number = number_of(zone.material))
        out.zones.push_back({*number, zone.outline, Region<PanelFrame>(zone.outline)});
  }
}

std::optional<std::size_t> MaterialLimits::number_of(const std::string& material) const {
  const auto found = std::ranges::find(limits_, material, &MaterialLimit::material);
  if (found == limits_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - limits_.begin());
}

LimitSet MaterialLimits::at(int panel, const Point<PanelFrame>& middle) const {
  if (limits_.empty()) return {};
  const Panel& of = panels_[static_cast<std::size_t>(panel)];
  LimitSet out = of.whole;
  for (const Zone& zone : of.zones)
    if (zone.region.contains(middle)) out.add(zone.number);
  return out;
}

LimitSet MaterialLimits::of(const Ring<ArtworkFrame>& outline, int panel,
                            const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork) const {
  return at(panel, panel_from_artwork * middle_of(outline));
}

std::vector<MaterialLimits::Wood> MaterialLimits::wood_under(std::size_t number) const {
  std::vector<Wood> out;
  for (std::size_t p = 0; p < panels_.size(); ++p) {
    if (panels_[p].whole.has(number)) out.push_back({static_cast<int>(p), panels_[p].outline});
    for (const Zone& zone : panels_[p].zones)
      if (zone.number == number) out.push_back({static_cast<int>(p), zone.outline});
  }
  return out;
}

bool MaterialLimits::has_other_wood() const {
  return std::ranges::any_of(panels_, [](const Panel& it) { return it.whole.empty(); }) || panels_.empty();
}

SquareMillimetres area_of(const Ring<ArtworkFrame>& outline) {
  return SquareMillimetres(std::abs(signed_area(outline)));
}

Point<ArtworkFrame> middle_of(const Ring<ArtworkFrame>& outline) {
  const Box<ArtworkFrame> box = bounds(outline);
  return {(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2};
}

}  // namespace veneer::planner
