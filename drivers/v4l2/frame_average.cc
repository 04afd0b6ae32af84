#include "drivers/v4l2/frame_average.h"

#include <algorithm>
#include <cmath>

namespace veneer::v4l2 {

SquareMeans::SquareMeans(const RawPicture& picture) {
  for (int top = 0; top < picture.height; top += kSide)
    for (int left = 0; left < picture.width; left += kSide) {
      const int bottom = std::min(top + kSide, picture.height), right = std::min(left + kSide, picture.width);
      const int pixels = (bottom - top) * (right - left);
      if (pixels * 4 < std::min(kSide, picture.height) * std::min(kSide, picture.width)) continue;
      std::uint32_t sum = 0;
      for (int y = top; y < bottom; ++y) {
        const std::uint8_t* at = picture.samples.data() + (static_cast<std::size_t>(y) * picture.width + left) * 3;
        for (int x = left; x < right; ++x, at += 3) sum += at[0] + 2U * at[1] + at[2];
      }
      means_.push_back(sum / (4.0 * pixels));
    }
}

double SquareMeans::most_change(const SquareMeans& other) const {
  double most = 0;
  for (std::size_t i = 0; i < std::min(means_.size(), other.means_.size()); ++i)
    most = std::max(most, std::abs(means_[i] - other.means_[i]));
  return most;
}

void FrameAverage::add(const RawPicture& picture) {
  if (count_++ == 0) {
    width_ = picture.width, height_ = picture.height;
    sums_.assign(picture.samples.begin(), picture.samples.end());
    return;
  }
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += picture.samples[i];
}

RawPicture FrameAverage::mean() const {
  RawPicture out{width_, height_, 3, 8, std::vector<std::uint8_t>(sums_.size())};
  const auto n = static_cast<std::uint32_t>(count_);
  for (std::size_t i = 0; i < sums_.size(); ++i)
    out.samples[i] = static_cast<std::uint8_t>((2 * sums_[i] + n) / (2 * n));
  return out;
}

}  // namespace veneer::v4l2
