// Drawings as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/drawing_work.h"
#include "daemon/orders/shapes_json.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawnSetting, power, speed_mm_s, passes, air)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LayerRecipe, layer, power, speed_mm_s)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReadDrawing, file, x_mm, y_mm, given, recipes, most_points)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawingWasRead, points)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawnKind, layer, colour, lines, length_mm, setting)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawingRead, page_mm, least_mm, most_mm, warnings, length_mm, kinds, kind_of_stroke,
                                   points_mm, strokes)

}  // namespace veneer::daemon
