// A sheet on the bed that is a little thicker or thinner than was said, or bowed: where it lies all the same. A camera
// that looks aslant sees what lies higher farther out, and a few tenths of a millimetre shift a sheet by some
// hundredths. Internal to bed_pose. Thread-safe.
#pragma once

#include <span>
#include <vector>

#include "base/frames.h"
#include "calib/camera_model.h"

namespace veneer::calib {

// A point of the sheet and the ray that it is seen along: where that meets the plane at the height that was given, and
// one millimetre above it.
struct RayToSheet {
  Point<PanelFrame> panel;
  Point<BedFrame> at_height, above;
};

// The pose of a sheet that is as thick as was said, to some tenths of a millimetre, and flat to as much: what the
// points say beyond that counts. `flat` is the pose that they have without.
Isometry2<BedFrame, PanelFrame> fit_lifted(std::span<const RayToSheet> rays,
                                           const Isometry2<BedFrame, PanelFrame>& flat);

}  // namespace veneer::calib
