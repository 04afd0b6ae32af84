#include "planner/boundaries/piece_faults.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "planner/parallel.h"

namespace veneer::planner {
namespace {

// Points of an outline that lie nearer than `border` to a pixel that is not free.
std::vector<Point<PanelFrame>> near_blocked(const Ring<PanelFrame>& outline, const Raster<PanelFrame>& free,
                                            Millimetres border) {
  const double reach = free.resolution.to_px(border).count();
  const auto is_near = [&](const Point<PanelFrame>& p) {
    double x = 0, y = 0;
    free.to_pixels(p, x, y);
    for (int r = static_cast<int>(std::floor(y - reach)); r <= static_cast<int>(std::floor(y + reach)); ++r)
      for (int c = static_cast<int>(std::floor(x - reach)); c <= static_cast<int>(std::floor(x + reach)); ++c) {
        const double dx = std::max({c - x, x - c - 1, 0.0}), dy = std::max({r - y, y - r - 1, 0.0});
        if (std::max(dx, dy) > reach) continue;
        if (r < 0 || c < 0 || r >= free.pixels.rows || c >= free.pixels.cols || free.pixels.at<std::uint8_t>(r, c) == 0)
          return true;
      }
    return false;
  };
  std::vector<Point<PanelFrame>> out;
  constexpr double kStep = 0.2;  // mm
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const int steps = std::max(1, static_cast<int>(distance(a, b).count() / kStep));
    for (int k = 0; k < steps; ++k) {
      const Point<PanelFrame> p{a.x + (b.x - a.x) * (static_cast<double>(k) / steps),
                                a.y + (b.y - a.y) * (static_cast<double>(k) / steps)};
      if (is_near(p)) out.push_back(p);
    }
  }
  return out;
}

}  // namespace

PieceFaults::Fault PieceFaults::of_shape(const Ring<ArtworkFrame>& outline) const {
  Fault out;
  if (const auto shape = fault_of(outline, limits_.limits, &out.places)) {
    out.found = true, out.everywhere = *shape != FabricationFault::kThin || out.places.empty();
  } else if (limits_.size.count() > 0 && offset(Region<ArtworkFrame>(outline), limits_.size / -2).empty()) {
    out.found = out.everywhere = true;
  }
  return out;
}

PieceFaults::Fault PieceFaults::of_piece(std::size_t i, const Ring<ArtworkFrame>& outline) {
  Fault fault = of_shape(outline);
  boxes_[i] = {};
  if (!placements_[i]) return fault;
  const auto& map = placements_[i]->panel_from_artwork;
  const Ring<PanelFrame> there = map * outline;
  const FreeWood& wood = panels_[static_cast<std::size_t>(placements_[i]->panel)].wood;
  if (!wood.on_free_wood(there)) {
    const std::vector<Point<PanelFrame>> near = near_blocked(there, wood.raster(), wood.border());
    for (const Point<PanelFrame>& p : near) fault.places.push_back(map.inverse() * p);
    fault.found = true, fault.everywhere = fault.everywhere || near.empty();
  }
  grown_[i] = offset(Region<PanelFrame>(there), wood.kerf() + (FreeWood::kSlack + kBorderRounding) / 2);
  for (const auto& ring : grown_[i].rings()) {
    for (const auto& p : ring) boxes_[i].add(p);
    if (signed_area(ring) > 0) continue;
    // A bay whose mouth the kerf closes: the wood in it would fall out with the piece.
    for (const auto& p : ring) fault.places.push_back(map.inverse() * p);
    fault.found = true;
  }
  return fault;
}

std::vector<PieceFaults::Fault> PieceFaults::of(const std::vector<Ring<ArtworkFrame>>& outlines) {
  const std::size_t count = outlines.size();
  const bool first = outlines_.empty();
  own_.resize(count), grown_.resize(count), boxes_.resize(count);
  std::vector<char> changed(count, 1);
  for (std::size_t i = 0; i < count && !first; ++i) changed[i] = outlines_[i] != outlines[i] ? 1 : 0;
  outlines_ = outlines;
  (void)run_parallel(count, threads_, {}, [&](std::size_t i) {
    if (changed[i] != 0) own_[i] = of_piece(i, outlines[i]);
  });
  std::vector<Fault> out = own_;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; placements_[i] && j < i; ++j) {
      if (!placements_[j] || placements_[i]->panel != placements_[j]->panel) continue;
      if (boxes_[i].min.x > boxes_[j].max.x || boxes_[j].min.x > boxes_[i].max.x || boxes_[i].min.y > boxes_[j].max.y ||
          boxes_[j].min.y > boxes_[i].max.y)
        continue;
      const auto [there, fresh] = shared_.try_emplace({i, j});
      if (fresh || changed[i] != 0 || changed[j] != 0) there->second = intersect(grown_[i], grown_[j]);
      for (const auto& ring : there->second.rings())
        for (const std::size_t k : {i, j}) {
          const auto back = placements_[k]->panel_from_artwork.inverse();
          for (const auto& p : ring) out[k].places.push_back(back * p);
          out[k].found = true;
        }
    }
  return out;
}

}  // namespace veneer::planner
