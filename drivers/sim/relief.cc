#include "drivers/sim/relief.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "drivers/sim/sheet.h"

namespace veneer::sim {

double Relief::lift(double u, double v, SheetFace face_up) const {
  const double way = face_up == SheetFace::kShow ? 1 : -1;
  // 1 in the middle, 0 at the ends; a sheet that stands on its middle has its ends in the air.
  const auto one = [way](double bow, double t) {
    const double arch = 4 * t * (1 - t), up = way * bow;
    return up >= 0 ? up * arch : -up * (1 - arch);
  };
  return one(bow_x_mm, std::clamp(u, 0.0, 1.0)) + one(bow_y_mm, std::clamp(v, 0.0, 1.0));
}

nlohmann::json to_json(const Relief& relief) { return {{"bow_x_mm", relief.bow_x_mm}, {"bow_y_mm", relief.bow_y_mm}}; }

Relief relief_from(const nlohmann::json& value) { return {value.value("bow_x_mm", 0.0), value.value("bow_y_mm", 0.0)}; }

}  // namespace veneer::sim
