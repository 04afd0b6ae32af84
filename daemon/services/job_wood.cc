#include "daemon/services/job_wood.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <set>

#include "daemon/services/panel_wood.h"

namespace veneer::daemon {
namespace {

struct Held {
  db::PanelRecord panel;
  std::vector<db::AllocationRecord> live;
  std::vector<db::ZoneRecord> zones;
};

Result<std::vector<Held>> read_panels(Repositories& r, const std::vector<PanelId>& wanted,
                                      std::vector<PanelId>& in_stock) {
  auto panels = r.panels.list();
  if (!panels) return panels.error();
  for (const auto& id : wanted)
    if (std::none_of(panels->begin(), panels->end(), [&](const auto& p) { return p.id == id; }))
      return Error{ErrorCode::kNotFound, fmt::format("there is no panel {}: see veneerctl panel list", id.value)};
  std::vector<Held> out;
  for (auto& panel : *panels) {
    in_stock.push_back(panel.id);
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), panel.id) == wanted.end()) continue;
    auto live = r.ledger.live_allocations(panel.id);
    if (!live) return live.error();
    auto zones = r.materials.zones(panel.id);
    if (!zones) return zones.error();
    out.push_back({std::move(panel), std::move(*live), std::move(*zones)});
  }
  return out;
}

bool is_wanted(const std::string& material, const std::vector<std::string>& woods) {
  return woods.empty() || std::find(woods.begin(), woods.end(), material) != woods.end();
}

Status check_woods(const std::vector<Held>& held, const std::vector<std::string>& woods) {
  std::set<std::string> known;
  for (const Held& panel : held)
    for (const auto& zone : panel.zones)
      if (!zone.material.empty()) known.insert(zone.material);
  for (const std::string& wood : woods)
    if (known.count(wood) == 0)
      return Error{ErrorCode::kInvalidArgument,
                   known.empty() ? fmt::format("no panel is known to have {}: say which wood a panel is of with "
                                               "veneerctl panel material",
                                               wood)
                                 : fmt::format("no panel has {}: there is {}", wood, fmt::join(known, ", "))};
  return Ok();
}

std::string species_of(const std::vector<db::ZoneRecord>& zones, const std::vector<std::string>& woods) {
  std::set<std::string> offered;
  for (const auto& zone : zones)
    if (is_wanted(zone.material, woods)) offered.insert(zone.material);
  return offered.size() == 1 ? *offered.begin() : "";
}

Raster<PanelFrame> only_zones(const Raster<PanelFrame>& free, const std::vector<db::ZoneRecord>& zones,
                              const std::vector<std::string>& woods) {
  if (woods.empty()) return free;
  std::vector<Ring<PanelFrame>> wanted, others;
  for (const auto& zone : zones) (is_wanted(zone.material, woods) ? wanted : others).push_back(zone.outline);
  return wood_within(free, wanted, others);
}

}  // namespace

Result<std::vector<planner::StockPanel>> load_job_wood(DatabaseThread& database, const PanelLibrary& library,
                                                       const JobRequest& request, Millimetres margin) {
  std::vector<PanelId> in_stock;
  const auto held = database.call([&](Repositories& r) { return read_panels(r, request.panels, in_stock); });
  if (!held) return held.error();
  if (held->empty())
    return Error{ErrorCode::kRefused, "there is no panel in stock: scan one with veneerctl panel scan"};
  library.keep_index_only(in_stock);
  if (const Status known = check_woods(*held, request.woods); !known) return known.error();
  std::vector<planner::StockPanel> stock;  // without pictures until it is known which panels are used
  for (const Held& h : *held) {
    const auto mask = library.load_mask(h.panel);
    if (!mask) return mask.error();
    // What was allocated is grown by its kerf already; a new run finds the panel a little elsewhere.
    const Raster<PanelFrame> free = free_wood(*mask, h.live, margin);
    if (cv::countNonZero(free.pixels) == 0) library.drop_index(h.panel.id);
    stock.push_back({h.panel.id, {}, only_zones(free, h.zones, request.woods), species_of(h.zones, request.woods)});
  }
  for (const auto& [panel, region] : request.forbidden)
    if (const Status gone = planner::forbid(stock, panel, region); !gone) return gone.error();
  if (request.max_panels && *request.max_panels < stock.size()) {
    std::stable_sort(stock.begin(), stock.end(),
                     [](const auto& a, const auto& b) { return wood_area(a.free) > wood_area(b.free); });
    stock.resize(*request.max_panels);
  }
  for (planner::StockPanel& panel : stock) {
    const auto of = std::find_if(held->begin(), held->end(), [&](const Held& h) { return h.panel.id == panel.id; });
    auto map = library.load_map(of->panel);
    if (!map) return map.error();
    panel.picture = std::move(*map);
  }
  for (const auto& [wood, weight] : request.wood_weights)
    if (const Status weighed = planner::weigh_tones(stock, wood, weight); !weighed) return weighed.error();
  return stock;
}

}  // namespace veneer::daemon
