// What no picture may exceed, whatever format it comes in.
#pragma once

#include <cstdint>

namespace veneer::planner {

// More than a panel of 20,000 x 14,000 pixels, so more than any target needs. A few kilobytes can claim a thousand
// times as much; such files are refused by what they say of themselves, before a pixel is unpacked.
constexpr std::int64_t kMostPixels = 300'000'000;

}  // namespace veneer::planner
