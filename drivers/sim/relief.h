// How a sheet that is not flat lies on the bed.
//
// Values, thread-safe.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "drivers/sim/plane.h"

namespace veneer::sim {

enum class SheetFace;

// Bent about both axes. Positive: on the show face its middle stands up; lying on its back it is then its rim.
struct Relief {
  double bow_x_mm = 0, bow_y_mm = 0;  // of the middle over the ends, along the width and along the height

  bool flat() const { return bow_x_mm == 0 && bow_y_mm == 0; }
  // By how much the face that looks up stands higher there than it would on a flat sheet; never below zero, since it
  // lies on the bed. `u`, `v`: place in parts of width and height.
  double lift(double u, double v, SheetFace face_up) const;
};

nlohmann::json to_json(const Relief& relief);
Relief relief_from(const nlohmann::json& value);

}  // namespace veneer::sim
