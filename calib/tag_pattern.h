// What AprilTags look like, for print. The detector (tag_detector.h) and this read the same library.
//
// What marks a place is of family 36h11: fiducials of panels, the AprilGrid. What only names a panel, on its label, is
// of Standard41h12. That family's square is white in black, not black in white, so that the detector of fiducials
// cannot take one for the other: a label may lie on the scanner or on the bed, or be stuck on its panel.
#pragma once

#include <array>

#include "base/result.h"

namespace veneer::calib {

inline constexpr int kTagIds = 587;        // numbers the family has, from 0
inline constexpr int kTagSquareCells = 8;  // along the black square, which is what a tag's size counts

// Cells of the whole tag, the white rim that belongs to it included: one cell around the black square.
struct TagPattern {
  static constexpr std::size_t kCells = kTagSquareCells + 2;
  std::array<std::array<bool, kCells>, kCells> black{};  // row 0 is the upper edge of the upright tag
};
// The same of family Standard41h12, whose outermost cells are bits: it needs no rim.
inline constexpr int kLabelTagIds = 2115;
struct LabelTagPattern {
  static constexpr std::size_t kCells = 9;
  std::array<std::array<bool, kCells>, kCells> black{};
};

// kInvalidArgument names the number when the family has no such tag. Thread-safe.
Result<TagPattern> tag_pattern(int id);
Result<LabelTagPattern> label_tag_pattern(int id);

}  // namespace veneer::calib
