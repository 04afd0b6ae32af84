#include "daemon/stock/seen_sheet.h"

#include <nlohmann/json.hpp>

#include "daemon/orders/scan_json.h"

namespace veneer::daemon {

using nlohmann::json;

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TakenTile, file, sha256, device, taken_at, dpi)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SuspectWood, allocation, piece)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SeenSheet, read, tiles, map_file, map_sha256, mask_file, panel, after, later_map,
                                   parent, parent_fiducials, suspects)

std::string to_text(const SeenSheet& seen) { return json(seen).dump(-1, ' ', false, json::error_handler_t::replace); }

std::optional<SeenSheet> seen_from_text(const std::string& text) {
  try {
    json seen = json::parse(text);
    json& read = seen.at("read");
    read.emplace("asked", json::array());
    read.emplace("edge_margin", PanelRead{}.edge_margin), read.emplace("round_margin", PanelRead{}.round_margin);
    return seen.get<SeenSheet>();
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::string to_text(const std::vector<ScanWarning>& warnings) {
  return json(warnings).dump(-1, ' ', false, json::error_handler_t::replace);
}

std::vector<ScanWarning> warnings_of(const db::ProposalRecord& proposal) {
  std::vector<ScanWarning> out;
  const json list = json::parse(proposal.warnings_json, nullptr, false);
  if (!list.is_array()) return out;
  for (const json& one : list)
    if (one.is_object()) out.push_back({one.value("name", ""), one.value("text", "")});
  return out;
}

}  // namespace veneer::daemon
