#include "drivers/lihuiyu/speed_code.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace veneer::lihuiyu {
namespace {

constexpr double kTicksPerMs = 12120;
constexpr double kCoarseBelow = 7;  // mm/s
constexpr double kCoarse = 12;
// The share of a step's time by which a diagonal step is longer. Recorded codes pin it to 0.26120 ... 0.26122.
constexpr double kDiagonalShare = 0.26121;

int acceleration(double speed) {
  if (speed <= 25.4) return 1;
  if (speed <= 60) return 2;
  return speed < 127 ? 3 : 4;
}

double base_ticks(int acceleration) {
  if (acceleration == 3) return 5632;
  return acceleration == 4 ? 6144 : 5120;
}

std::string two_bytes(int value) { return fmt::format("{:03}{:03}", value / 256, value % 256); }

}  // namespace

std::string speed_code(MmPerSecond speed) {
  const double v = speed.count(), period_ms = 25.4 / v;
  const bool coarse = v < kCoarseBelow;
  const double ticks_per_ms = coarse ? kTicksPerMs / kCoarse : kTicksPerMs;
  const int a = acceleration(v);
  const double ticks = (coarse ? 8 : base_ticks(a)) + ticks_per_ms * period_ms;
  const int steps = std::min(static_cast<int>(std::floor(v)) + 1, 128);
  const double diagonal = kDiagonalShare * ticks_per_ms * period_ms / steps;
  return fmt::format("CV{}{}{:03}{}{}", two_bytes(65536 - static_cast<int>(ticks)), a, steps,
                     two_bytes(std::min(static_cast<int>(diagonal), 65535)), coarse ? "C" : "");
}

}  // namespace veneer::lihuiyu
