// Toolpaths as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include <chrono>

#include "daemon/orders/shapes_json.h"
#include "daemon/orders/toolpath_work.h"

namespace nlohmann {
template <>
struct adl_serializer<std::chrono::duration<double>> {
  static void to_json(json& j, const std::chrono::duration<double>& seconds) { j = seconds.count(); }
  static void from_json(const json& j, std::chrono::duration<double>& seconds) {
    seconds = std::chrono::duration<double>(j.get<double>());
  }
};
}  // namespace nlohmann

namespace veneer {

NLOHMANN_JSON_SERIALIZE_ENUM(StrokeRole, {{StrokeRole::kCut, "cut"},
                                          {StrokeRole::kEngrave, "engrave"},
                                          {StrokeRole::kPattern, "pattern"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StrokeIn<BedFrame>, piece, role, path, speed, power, passes, air, overscan)

}  // namespace veneer

namespace veneer::planner {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Recipe, cut_speed, cut_power, cut_passes, engrave_speed, engrave_power,
                                   engrave_passes, air, engrave_air, kerf_back, kerf_show)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MarkOptions, height, good_height, min_height, margin, min_margin)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LeadOptions, length, overlap)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BridgeOptions, on, below, width, count)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Kinematics, rapid_x, rapid_y, acceleration_x, acceleration_y, junction_deviation,
                                   planner_moves, queued, longest_move, drain)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Lead<BedFrame>, begin, end)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ToolpathPiece, piece, outline, holes, mark, artwork_up, recipe, leads)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ToolpathOptions, recipe, marks, leads, bridges, fit_clearance, cool_distance,
                                   assembly_order, kinematics, start)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ToolpathSummary, piece, strokes, bridges, lead, estimate)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Toolpath, strokes, pieces, warnings, burnt, travel, hot_pairs, estimate)

}  // namespace veneer::planner

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LayToolpath, pieces, options)

}  // namespace veneer::daemon
