#include "calib/fiducials.h"

#include <fmt/format.h>

namespace veneer::calib {

std::string name_of(const FiducialOffset& fiducial) {
  if (fiducial.tag >= 0) return fmt::format("tag {}", fiducial.tag);
  return fmt::format("the hole at {:.0f}, {:.0f}", fiducial.place.x.count(), fiducial.place.y.count());
}

}  // namespace veneer::calib
