// Printed AprilTags (36h11), drawn with libapriltag's own generator: OpenCV's pictures of the same family are turned by
// 180 degrees, and with one tag nobody would notice.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/result.h"
#include "drivers/sim/plane.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

inline constexpr int kTagFamilySize = 587;

// Where a tag is printed: centre in sheet mm, turned counter-clockwise as its own face shows it.
struct TagPlace {
  int id = 0;
  SheetFace face = SheetFace::kShow;
  Vec2 centre;
  double angle_rad = 0;
  double square_mm = 14;  // true side of the black square
};

// Prints tag and white quiet zone (one cell wide) into the sheet's raster of that face, edges exact to a thousandth of
// a pixel, and enters it in sheet.tags. The id must be below kTagFamilySize.
void print_tag(Sheet& sheet, const TagPlace& place);

}  // namespace veneer::sim
