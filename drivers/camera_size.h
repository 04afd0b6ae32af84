// Which pictures of a camera can be the bed's: what is smaller shows no tag, and what is larger fills the memory.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "base/result.h"

namespace veneer {

inline constexpr int kLeastCameraSide = 64, kMostCameraSide = 20'000;  // pixels, of width and height
inline constexpr std::int64_t kMostCameraPixels = 50'000'000;

// kInvalidArgument, for whoever picks one.
inline Status check_camera_size(int width, int height) {
  if (std::min(width, height) >= kLeastCameraSide && std::max(width, height) <= kMostCameraSide &&
      std::int64_t{width} * height <= kMostCameraPixels)
    return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("{} x {} pixels are no size for a picture of the bed: use one of {} to {} pixels a side and "
                           "at most {} million in all, or another camera",
                           width, height, kLeastCameraSide, kMostCameraSide, kMostCameraPixels / 1'000'000)};
}

}  // namespace veneer
