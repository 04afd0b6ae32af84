// Shapes on a panel, for tests.
#pragma once

#include "base/geometry.h"

namespace veneer::testing {

// Its lower left corner at x, y.
inline Ring<PanelFrame> panel_square(double x_mm, double y_mm, double side_mm) {
  return {point<PanelFrame>(x_mm, y_mm), point<PanelFrame>(x_mm + side_mm, y_mm),
          point<PanelFrame>(x_mm + side_mm, y_mm + side_mm), point<PanelFrame>(x_mm, y_mm + side_mm)};
}

}  // namespace veneer::testing
