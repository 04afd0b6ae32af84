// What an AprilTag of family 36h11 looks like, for print. The detector (tag_detector.h) and this read the same library.
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

// kInvalidArgument names the number when the family has no such tag. Thread-safe.
Result<TagPattern> tag_pattern(int id);

}  // namespace veneer::calib
