// Several frames of what does not move, as one picture with less noise. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/raw_picture.h"

namespace veneer::v4l2 {

// Grey levels in squares of a picture. Noise vanishes in a square's mean: of 256 pixels that scatter by 15 levels each
// it scatters by 1. What moves by a pixel along a strong edge, or light that changes, does not.
class SquareMeans {
 public:
  static constexpr int kSide = 16;                  // pixels
  explicit SquareMeans(const RawPicture& picture);  // RGB of 8 bits
  // The largest difference of two squares, 0 to 255. REQUIRES: pictures of one size.
  double most_change(const SquareMeans& other) const;

 private:
  std::vector<double> means_;  // of squares with at least a quarter of their pixels
};

class FrameAverage {
 public:
  // REQUIRES: RGB of 8 bits, all of one size, at most 65,000 of them.
  void add(const RawPicture& picture);
  int count() const { return count_; }
  // Each sample the mean of its own, rounded to the nearest, halves up. REQUIRES: at least one.
  RawPicture mean() const;

 private:
  int count_ = 0, width_ = 0, height_ = 0;
  std::vector<std::uint32_t> sums_;
};

}  // namespace veneer::v4l2
