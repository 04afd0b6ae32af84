// Speed codes of LHYMICRO-GL for vector work on M2 and M3 boards.
//
//   CV hhh lll a sss hhh lll [C]
//
// Three decimal digits are one byte. hhhlll is the step timer's reload value, 65536 minus the ticks of one step;
// a the acceleration (1 slow and strong ... 4); sss and the second hhhlll slow diagonal steps down; a last C selects a
// timer twelve times coarser, for speeds below 7 mm/s. Ticks of one step of T = 25.4 / speed milliseconds:
//
//   b + m T      m = 12120; b = 5120 (a = 1, 2), 5632 (3), 6144 (4); with the last C: m = 1010, b = 8
//
// Rounding follows codes recorded from the vendor's own program (docs/LIHUIYU.md): the ticks are cut off to whole ones.
//
// Pure functions; thread-safe.
#pragma once

#include <string>

#include "base/units.h"

namespace veneer::lihuiyu {

// A step timer of 16 bits goes no slower; faster, the vendor's program refuses vector work.
inline constexpr double kSlowestMmPerSecond = 0.4;
inline constexpr double kFastestMmPerSecond = 240;

// `speed` within the limits above.
std::string speed_code(MmPerSecond speed);

}  // namespace veneer::lihuiyu
