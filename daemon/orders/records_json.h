// Records of the database as JSON, as far as worker processes are told of them or answer with them.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/orders/shapes_json.h"
#include "db/materials.h"
#include "db/plans.h"

namespace veneer::db {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(KerfRecord, back, show)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RecipeRecord, material, operation, speed, power, passes, air, kerf, changed_at)
inline void to_json(nlohmann::json& j, const ZoneRecord& zone) {
  j = {{"number", zone.number}, {"shape", zone.shape}, {"material", zone.material}, {"confidence", zone.confidence}};
}
// Of a scan that waited while the program became this one, too: until then zones were rings.
inline void from_json(const nlohmann::json& j, ZoneRecord& zone) {
  j.at("number").get_to(zone.number);
  zone.shape = j.contains("outline") ? Region<PanelFrame>(j.at("outline").get<Ring<PanelFrame>>())
                                     : j.at("shape").get<Region<PanelFrame>>();
  j.at("material").get_to(zone.material);
  zone.confidence = j.contains("confidence") ? j.at("confidence").get<std::optional<double>>() : std::nullopt;
}
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PlannedPatch, mark, artwork_outline, panel, panel_outline, allocation,
                                   panel_from_artwork, lead_in)

}  // namespace veneer::db
