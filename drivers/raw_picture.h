// A picture as a scanner or camera delivered it, before anybody has looked at it.
#pragma once

#include <cstdint>
#include <vector>

namespace veneer {

// Rows from the top; RGB interleaved, or grey.
struct RawPicture {
  int width = 0, height = 0;
  int channels = 0;  // 1 or 3
  int bits = 8;      // or 16, in the byte order of this machine
  std::vector<std::uint8_t> samples;
};

}  // namespace veneer
