// Records of the database as JSON, as far as worker processes are told of them or answer with them.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/orders/shapes_json.h"
#include "db/materials.h"
#include "db/plans.h"

namespace veneer::db {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(KerfRecord, back, show)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RecipeRecord, material, operation, speed, power, passes, air, kerf, changed_at)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ZoneRecord, number, shape, material)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PlannedPatch, mark, artwork_outline, panel, panel_outline, allocation,
                                   panel_from_artwork, lead_in)

}  // namespace veneer::db
