// A belt is off by the same at each turn of its pulley. The pattern that the axes are measured with must meet that
// error at all its phases, or its certificate knows nothing of it.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/support/played_sight.h"

namespace veneer::tests {
namespace {

constexpr int kMachines = 10;

// Over the beds of some machines whose pulleys have this turn: the share of places where the laser burns within twice
// what the certificate says.
double within_two_sigma(double period_mm, RingSpacing spacing) {
  sim::Roughness rough;
  rough.belt_wave_mm = 0.03, rough.belt_period_mm = period_mm;
  int places = 0, within = 0;
  double said = 0, truly = 0;
  for (std::uint64_t seed = 1; seed <= kMachines; ++seed) {
    const auto figures = play_axes_certificate(seed, rough, spacing);
    EXPECT_TRUE(figures.ok()) << "seed " << seed << ": " << figures.error().message;
    if (!figures) continue;
    places += figures->places, within += figures->within_two_sigma;
    said += figures->said_mm / kMachines, truly += figures->true_mm / kMachines;
  }
  const double share = static_cast<double>(within) / places;
  std::cout << "turn " << period_mm << " mm: said " << said << " mm, truly " << truly << " mm rms; " << 100 * share
            << " % of places within two sigma\n";
  return share;
}

TEST(AxesCertificate, KnowsABeltsErrorWhateverItsPulley) {
  for (const double period : {32.0, 36.0, 40.0})  // 16, 18 and 20 teeth on a belt of 2 mm
    EXPECT_GE(within_two_sigma(period, RingSpacing::kUneven), 0.9) << "turn of " << period << " mm";
}

// What the pattern was like before: the same rings, one turn of a pulley apart, and the figure was for nothing.
TEST(AxesCertificate, OfEvenRingsWouldNotKnowIt) { EXPECT_LT(within_two_sigma(40, RingSpacing::kEven), 0.8); }

}  // namespace
}  // namespace veneer::tests
