#include "tests/soak/wood_places.h"

#include <gtest/gtest.h>

#include <random>

namespace veneer::soak {
namespace {

struct Life {
  int jobs = 0, larger = 0, left = 0;
};

// As cell_life.cc lives, on panels that have so many places each, until they are used up or all jobs are done.
Life life(int panels, int of_a_panel, int wanted, unsigned seed) {
  std::mt19937 random(seed);
  const auto below = [&](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  WoodPlaces places(panels);
  Life out;
  for (out.left = panels * of_a_panel; out.jobs < wanted; ++out.jobs) {
    int across = places.across(wanted - out.jobs, below(1000) / 1000.0);
    while (across > 0 && across * across > out.left) --across;
    if (across == 0) return out;
    out.larger += across > 1 ? 1 : 0;
    if (below(12) == 0) continue;  // cancelled: its places are back
    places.take(across * across);
    out.left -= across * across;
    if (below(15) > 0 || out.left == 0) continue;
    places.take(1);  // made again
    --out.left;
  }
  return out;
}

TEST(WoodPlaces, LastForAllJobsThatAreWanted) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const Life lived = life(66, WoodPlaces::kOfAPanel, 2000, seed);
    EXPECT_EQ(lived.jobs, 2000) << seed;
    EXPECT_GT(lived.larger, 0) << seed;
    EXPECT_LT(lived.left, 66 * WoodPlaces::kOfAPanel / 5) << seed << ": what is left is used up soon after";
  }
}

TEST(WoodPlaces, LastWherePanelsHaveATenthLess) {
  for (unsigned seed = 1; seed <= 50; ++seed) EXPECT_EQ(life(66, 32, 2000, seed).jobs, 2000) << seed;
}

TEST(WoodPlaces, OfFewJobsMakeLargeOnes) {
  const WoodPlaces places(60);
  EXPECT_EQ(places.across(100, 0.99), 3);
  EXPECT_EQ(places.across(400, 0.99), 2);
  EXPECT_EQ(places.across(1900, 0.5), 1);
}

}  // namespace
}  // namespace veneer::soak
