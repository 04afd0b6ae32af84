// Where a hand lays a sheet: poses drawn at random such that the sheet fits.
#pragma once

#include <string>

#include "base/result.h"
#include "drivers/sim/cell_truth.h"
#include "drivers/sim/random.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

// glass_from_sheet. Whole sheets may come to lie in any quarter turn that fits, parts upright or upside down, and every
// one a few degrees askew. `part`: "whole", "left", "right", "bottom", "top" of the face as its viewer sees it upright.
// kInvalidArgument for an unknown part, kRefused when it does not fit.
Result<SheetPose> lay_on_glass(const Sheet& sheet, SheetFace down, const std::string& part, double glass_width,
                               double glass_height, Random& random);
// bed_from_sheet: somewhere on the bed with the whole sheet in reach of the beam.
Result<SheetPose> lay_on_bed(const Sheet& sheet, SheetFace up, const TwinSettings::Bed& bed, Random& random);

// bed_from_sheet as a person lays it who was told where: the middle of the upper face at `middle`, its upright turned
// by `turn_deg`, a few millimetres beside and half a degree askew. It may stick out over the bed's edge.
SheetPose lay_as_told(const Sheet& sheet, SheetFace up, Vec2 middle, double turn_deg, Random& random);

}  // namespace veneer::sim
