#include "drivers/sim/carriage.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/units.h"
#include "drivers/sim/random.h"

namespace veneer::sim {
namespace {

constexpr double kBeltBit = 2;  // mm; the belt's wave is followed in bits this long
constexpr double kLeastBit = 1e-4;

// How much of a motion by `way` is over when the carriage, `lag` behind, begins to follow; 0 when it follows at once.
double taken_up_at(double lag, double way, double play) {
  if (std::abs(way) < 1e-12) return 0;
  const double end = way > 0 ? play / 2 : -play / 2;  // the lag at which it is pulled along
  return std::clamp((end - lag) / way, 0.0, 1.0);
}

}  // namespace

Carriage::Carriage(const Roughness& roughness, std::uint64_t seed) : roughness_(roughness), seed_(seed) {
  Random random(seed, "belt");
  belt_phase_ = {random.uniform(0, 2 * kPi), random.uniform(0, 2 * kPi)};
}

void Carriage::homed(int number) {
  Random random(seed_, "homing", static_cast<std::uint64_t>(number));
  scatter_ = {random.spread(roughness_.homing_scatter_mm), random.spread(roughness_.homing_scatter_mm)};
  // It backed off the switches, at the upper right.
  lag_ = {-roughness_.backlash_mm / 2, -roughness_.backlash_mm / 2};
}

Vec2 Carriage::place(const MachineAxes& axes, Vec2 commanded) const {
  const Vec2 bed = axes.bed_from_commanded(commanded);
  const auto wave = [&](double at, double phase) {
    return roughness_.belt_wave_mm * std::sin(2 * kPi * at / roughness_.belt_period_mm + phase);
  };
  return bed + scatter_ + Vec2{wave(commanded.x, belt_phase_.x), wave(commanded.y, belt_phase_.y)};
}

std::vector<Carriage::Place> Carriage::follow(const MachineAxes& axes, Vec2 from, Vec2 to) {
  const Vec2 way = to - from;
  const double play = roughness_.backlash_mm;
  const std::array<double, 2> turns = {taken_up_at(lag_.x, way.x, play), taken_up_at(lag_.y, way.y, play)};
  std::vector<double> wanted = {turns[0], turns[1]};
  const int bits = roughness_.belt_wave_mm > 0 ? static_cast<int>(std::ceil(length(way) / kBeltBit)) : 1;
  for (int i = 1; i < bits; ++i) wanted.push_back(static_cast<double>(i) / bits);
  std::sort(wanted.begin(), wanted.end());
  std::vector<double> shares = {0};
  for (const double t : wanted)
    if ((t - shares.back()) * length(way) > kLeastBit && (1 - t) * length(way) > kLeastBit) shares.push_back(t);
  shares.push_back(1);
  const auto lag_at = [&](double share) {
    const auto one = [&](double lag, double gone) { return std::clamp(lag + gone, -play / 2, play / 2); };
    return Vec2{one(lag_.x, way.x * share), one(lag_.y, way.y * share)};
  };
  std::vector<Place> out;
  out.reserve(shares.size());
  Vec2 before = lag_;
  for (const double share : shares) {
    const Vec2 lag = lag_at(share);
    out.push_back({place(axes, from + way * share - lag), share, length(lag - before)});
    before = lag;
  }
  lag_ = lag_at(1);
  return out;
}

}  // namespace veneer::sim
