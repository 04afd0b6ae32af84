// The simulated camera over the bed.
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
  double face_height_mm = 0;  // of the upper face above the bed, where the sheet's relief does not lift it
};

class BedCamera {
 public:
  BedCamera(const CameraTruth& camera, const TwinSettings::Bed& bed);
  // BGR picture of the bed, in the light that `rough` makes of it. Equal arguments give equal pictures. Uses all cores;
  // thread-safe.
  cv::Mat picture(const BedView& view, std::uint64_t seed, const Roughness& rough = {}) const;
  // Where on the sheet, in sheet mm, the camera looks through a pixel.
  Vec2 on_sheet(const BedView& view, Vec2 pixel) const;

 private:
  CameraTruth camera_;
  TwinSettings::Bed bed_;
  cv::Mat ground_;  // the bed from above, drawn once
};

}  // namespace veneer::sim
