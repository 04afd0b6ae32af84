// The simulated camera over the bed.
//
// Pure function; uses all cores.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "drivers/sim/cell_truth.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

// A sheet as the camera sees it.
struct BedView {
  const Sheet* sheet = nullptr;  // null: the bed is empty
  SheetFace face_up = SheetFace::kBack;
  SheetPose bed_from_sheet;
  double face_height_mm = 0;  // of the upper face above the bed
};

// BGR picture of the bed. Equal arguments give equal pictures.
cv::Mat render_camera(const CameraTruth& camera, const TwinSettings::Bed& bed, const BedView& view, std::uint64_t seed);

}  // namespace veneer::sim
