#include "daemon/orders/job_wood.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <set>
#include <utility>

#include "daemon/orders/panel_wood.h"
#include "daemon/orders/stored_picture.h"
#include "planner/matching/index_cache.h"

namespace veneer::daemon {
namespace {

bool is_wanted(const std::string& material, const std::vector<std::string>& woods) {
  return woods.empty() || std::find(woods.begin(), woods.end(), material) != woods.end();
}

Status check_woods(const std::vector<HeldPanel>& held, const std::vector<std::string>& woods) {
  std::set<std::string> known;
  for (const HeldPanel& panel : held)
    for (const auto& zone : panel.zones)
      if (!zone.material.empty() && !zone.shape.empty()) known.insert(zone.material);
  for (const std::string& wood : woods)
    if (known.count(wood) == 0)
      return Error{ErrorCode::kInvalidArgument,
                   known.empty() ? fmt::format("no panel is known to have {}: say which wood a panel is of with "
                                               "veneerctl panel material",
                                               wood)
                                 : fmt::format("no panel has {}: there is {}", wood, fmt::join(known, ", "))};
  return Ok();
}

std::string material_of(const std::vector<db::ZoneRecord>& zones, const std::vector<std::string>& woods) {
  std::set<std::string> offered;
  for (const auto& zone : zones)
    if (!zone.shape.empty() && is_wanted(zone.material, woods)) offered.insert(zone.material);
  return offered.size() == 1 ? *offered.begin() : "";
}

// Rings around less than this are what rounding made.
constexpr double kLeastRing = 1;  // mm2

// The region in parts that have no holes: each hole is cut through its middle, across its longer side, so that a hole
// of more than kLeastRing is always parted. Smaller ones are filled, and smaller parts left out.
std::vector<Ring<PanelFrame>> without_holes(const Region<PanelFrame>& region) {
  auto rings = region.rings();
  std::erase_if(rings, [](const auto& ring) { return std::abs(signed_area(ring)) < kLeastRing; });
  const auto hole = std::ranges::find_if(rings, [](const auto& ring) { return signed_area(ring) < 0; });
  if (hole == rings.end()) return rings;
  const Box<PanelFrame> whole = region.box(), around = bounds(*hole);
  Box<PanelFrame> lower = whole, upper = whole;
  if (around.max.x - around.min.x > around.max.y - around.min.y)
    lower.max.x = upper.min.x = (around.min.x + around.max.x) / 2;
  else
    lower.max.y = upper.min.y = (around.min.y + around.max.y) / 2;
  std::vector<Ring<PanelFrame>> out;
  for (const auto& [min, max] : {lower, upper}) {
    const Region<PanelFrame> side(Ring<PanelFrame>{min, {max.x, min.y}, max, {min.x, max.y}});
    std::ranges::move(without_holes(intersect(region, side)), std::back_inserter(out));
  }
  return out;
}

// Of a panel that offers several woods, what is known of each.
std::vector<planner::WoodZone> zones_of_several(const std::vector<db::ZoneRecord>& zones,
                                                const std::vector<std::string>& woods) {
  std::vector<planner::WoodZone> out;
  if (!material_of(zones, woods).empty()) return out;
  for (const auto& zone : zones)
    if (!zone.material.empty() && is_wanted(zone.material, woods))
      for (auto& outline : without_holes(zone.shape)) out.push_back({zone.material, std::move(outline)});
  return out;
}

Raster<PanelFrame> only_zones(const Raster<PanelFrame>& free, const std::vector<db::ZoneRecord>& zones,
                              const std::vector<std::string>& woods) {
  if (woods.empty()) return free;
  std::vector<Region<PanelFrame>> wanted, others;
  for (const auto& zone : zones) (is_wanted(zone.material, woods) ? wanted : others).push_back(zone.shape);
  return wood_within(free, wanted, others);
}

// What of `free`, as the job found it, is left today.
Result<Raster<PanelFrame>> open_wood(const HeldPanel& panel, const Raster<PanelFrame>& free, Millimetres margin) {
  Raster<PanelFrame> out{cv::Mat::zeros(free.pixels.size(), CV_8UC1), free.resolution, free.origin};
  if (panel.closed) return out;
  const auto mask = read_stored_raster(panel.mask_now);
  if (!mask) return mask.error();
  if (mask->pixels.size() != free.pixels.size())
    return Error{
        ErrorCode::kStorage,
        fmt::format("the picture of panel {} is of another size than when the job was planned: retire the panel "
                    "and scan it as a new one",
                    panel.id.value)};
  std::vector<Region<PanelFrame>> taken = panel.live;
  taken.insert(taken.end(), panel.own.begin(), panel.own.end());
  cv::bitwise_and(free.pixels, free_wood(*mask, taken, margin).pixels, out.pixels);
  return out;
}

// All remnants, and of the fresh panels the fullest until there is enough wood.
std::vector<planner::StockPanel> remnants_before_fresh(std::vector<planner::StockPanel> stock, const JobWood& wood,
                                                       SquareMillimetres picture) {
  std::vector<std::pair<SquareMillimetres, std::size_t>> fresh;
  SquareMillimetres offered(0);
  std::vector<bool> taken(stock.size());
  for (std::size_t i = 0; i < stock.size(); ++i) {
    const SquareMillimetres free = wood_area(stock[i].free);
    taken[i] = wood.panels[i].remnant || !wood.panels[i].own.empty();
    if (taken[i])
      offered += free;
    else
      fresh.emplace_back(free, i);
  }
  std::stable_sort(fresh.begin(), fresh.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (auto next = fresh.begin(); next != fresh.end() && offered < picture * kEnoughWood; ++next)
    taken[next->second] = true, offered += next->first;
  std::vector<planner::StockPanel> out;
  for (std::size_t i = 0; i < stock.size(); ++i)
    if (taken[i]) out.push_back(std::move(stock[i]));
  return out;
}

// As many as are allowed. Places whose remnants leave too little wood to choose from go to the fullest panels.
std::vector<planner::StockPanel> chosen_panels(std::vector<planner::StockPanel> stock, const JobWood& wood,
                                               SquareMillimetres picture) {
  struct Offer {
    std::size_t index;
    SquareMillimetres free;
    bool first;
  };
  std::vector<Offer> offers;
  for (std::size_t i = 0; i < stock.size(); ++i)
    offers.push_back({i, wood_area(stock[i].free), wood.remnants_first.value_or(false) && wood.panels[i].remnant});
  std::stable_sort(offers.begin(), offers.end(),
                   [](const Offer& a, const Offer& b) { return a.first != b.first ? a.first : a.free > b.free; });
  const auto rest = offers.begin() + static_cast<std::ptrdiff_t>(*wood.max_panels);
  const auto offered = [&] {
    SquareMillimetres sum(0);
    for (auto it = offers.begin(); it != rest; ++it) sum += it->free;
    return sum;
  };
  // Fresh panels come last and are the fullest of their kind; before them the smallest remnant that was chosen.
  for (auto place = rest; place != offers.begin() && offered() < picture * kEnoughWood;) {
    const auto fullest =
        std::max_element(rest, offers.end(), [](const Offer& a, const Offer& b) { return a.free < b.free; });
    if ((--place)->free < fullest->free) std::iter_swap(place, fullest);
  }
  std::vector<planner::StockPanel> out;
  for (auto it = offers.begin(); it != rest; ++it) out.push_back(std::move(stock[it->index]));
  return out;
}

void drop_index(const std::string& index_dir, const PanelId& panel) {
  if (auto cache = planner::IndexCache::open(index_dir)) cache->drop(panel.value);
}

}  // namespace

WoodPictures stored_wood() {
  return {[](const HeldPanel& panel) { return read_stored_raster(panel.map); },
          [](const HeldPanel& panel, Millimetres margin) -> Result<Raster<PanelFrame>> {
            const auto mask = read_stored_raster(panel.mask);
            if (!mask) return mask.error();
            // What was allocated is grown by its kerf already; a new run finds the panel a little elsewhere.
            return free_wood(*mask, panel.live, margin);
          }};
}

Result<std::vector<planner::StockPanel>> load_job_wood(const JobWood& wood, SquareMillimetres picture) {
  return load_job_wood(wood, picture, stored_wood());
}

Result<std::vector<planner::StockPanel>> load_job_wood(const JobWood& wood, SquareMillimetres picture,
                                                       const WoodPictures& pictures) {
  if (const Status known = check_woods(wood.panels, wood.woods); !known) return known.error();
  for (const auto& [material, share] : wood.wood_limits)
    if (const Status known = check_woods(wood.panels, {material}); !known) return known.error();
  std::vector<planner::StockPanel> stock;  // without pictures until it is known which panels are used
  for (const HeldPanel& h : wood.panels) {
    const auto free = pictures.free(h, wood.margin);
    if (!free) return free.error();
    if (cv::countNonZero(free->pixels) == 0 && !wood.index_dir.empty()) drop_index(wood.index_dir, h.id);
    stock.push_back({h.id,
                     {},
                     only_zones(*free, h.zones, wood.woods),
                     {},
                     material_of(h.zones, wood.woods),
                     1,
                     zones_of_several(h.zones, wood.woods)});
  }
  for (const auto& [panel, region] : wood.forbidden)
    if (const Status gone = planner::forbid(stock, panel, region); !gone) return gone.error();
  for (std::size_t i = 0; i < stock.size(); ++i) {
    if (wood.panels[i].mask_now.empty()) continue;
    auto open = open_wood(wood.panels[i], stock[i].free, wood.margin);
    if (!open) return open.error();
    stock[i].open = std::move(*open);
  }
  if (wood.max_panels && *wood.max_panels < stock.size())
    stock = chosen_panels(std::move(stock), wood, picture);
  else if (wood.remnants_first.value_or(false))
    stock = remnants_before_fresh(std::move(stock), wood, picture);
  for (planner::StockPanel& panel : stock) {
    const auto of =
        std::find_if(wood.panels.begin(), wood.panels.end(), [&](const HeldPanel& h) { return h.id == panel.id; });
    auto map = pictures.map(*of);
    if (!map) return map.error();
    panel.picture = std::move(*map);
  }
  for (const auto& [material, weight] : wood.wood_weights)
    if (const Status weighed = planner::weigh_tones(stock, material, weight); !weighed) return weighed.error();
  return stock;
}

}  // namespace veneer::daemon
