// Compares a new map of a panel with what the ledger believes is gone. Thread-safe.
#pragma once

#include <vector>

#include "base/polygon_ops.h"
#include "base/raster.h"
#include "base/result.h"
#include "calib/fiducials.h"

namespace veneer::calib {

enum class DifferenceKind {
  kGoneNotBooked,  // wood is missing that the ledger holds for present
  kBookedNotGone,  // the ledger booked wood as cut that is still in the panel
};
constexpr const char* to_string(DifferenceKind kind) {
  return kind == DifferenceKind::kGoneNotBooked ? "gone_not_booked" : "booked_not_gone";
}

struct Difference {
  DifferenceKind kind = DifferenceKind::kGoneNotBooked;
  Point<PanelFrame> place{};  // a point of it, well inside
  Region<PanelFrame> shape;   // all of it
  SquareMillimetres area{0};
};

struct ReconcileOptions {
  // Borders may differ by this: beside what is booked that much more wood may be missing untold.
  Millimetres tolerance{0.3};
  // Smaller ones may be dust; a screw's hole has 7. Of a loss beside what is booked the tolerance is not seen, so this
  // is less than the smallest loss that is to be told, 3 mm2. Of what is gone small ones are told only if they differ
  // much.
  SquareMillimetres smallest{2.0};
  Millimetres narrowest{0.5};  // thinner ones are noise at borders
  // Pieces of which nobody knows whether they were cut out: nothing is learnt from them.
  std::vector<Region<PanelFrame>> uncertain = {};
};

struct Reconciliation {
  std::vector<Difference> differences;  // largest first
  SquareMillimetres gone{0};            // seen to be missing, within the sheet
  Raster<PanelFrame> gone_mask;         // CV_8UC1, 255 = missing; about 6 px/mm
  // False: the two maps differ by more than any lamp makes of them, or less than 3 mm2 are neither booked nor
  // uncertain, so that the change of light could not be learnt: differences may be told that are none, and gone_mask
  // says nothing.
  bool light_known = true;
};

// `before` is the map the stock was made from and `now` the new one, both of the show face, of the same area at the
// same resolution. `booked_gone` holds what was cut with its kerf, one region a piece: the tolerance is each piece's
// own, so the fine web that may stay between two bookings that touch is no difference. `wood` is what the ledger takes
// for wood, CV_8UC1 as large as the maps: beside it nothing is told as gone. Null: the whole sheet.
//
// Nothing is judged by its colour. Wood is gone where `now` is unlike `before` by more than light, drifting colours,
// the maps' noise and smoke make of it; light and noise are learnt from what was neither booked nor is uncertain, the
// light of the whole sheet at once.
// kInvalidArgument when the maps do not compare.
//
// Memory, over the two maps: up to 14 kB a square millimetre of a tile of 340 mm, and 17 bytes a pixel of 6 px/mm of
// the sheet; below 3 GB at 209 million pixels.
Result<Reconciliation> reconcile(const Raster<PanelFrame>& before, const Raster<PanelFrame>& now,
                                 const std::vector<Region<PanelFrame>>& booked_gone, const PanelFiducials& fiducials,
                                 const ReconcileOptions& options = {}, const Raster<PanelFrame>* wood = nullptr);

// How much of the inside of `outline`, all that lies farther than `margin` from its border, is missing: 0 to 1. Nothing
// of an outline that has no such inside, or lies beside the mask. `gone_mask`: that of a reconciliation.
double share_gone(const Raster<PanelFrame>& gone_mask, const Region<PanelFrame>& outline, Millimetres margin);

}  // namespace veneer::calib
