#include "planner/boundaries/edge_strip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

namespace veneer::planner {
namespace {

constexpr double kReach = 12, kGap = 4, kPartLength = 6, kNoBend = 1e-6;

using Path = std::vector<PlanePoint>;
const Path kLevel{{10, 30}, {90, 30}};

// Over 100 x 60 pixels: 1 where the face shows the picture badly, else 0.
FaceCost bad_where(const std::function<bool(double column, double row)>& is_bad) {
  FaceCost out{{0, 0, 100, 60}, cv::Mat(60, 100, CV_32FC1)};
  for (int r = 0; r < 60; ++r)
    for (int c = 0; c < 100; ++c) out.cost.at<float>(r, c) = is_bad(c + 0.5, r + 0.5) ? 1.0F : 0.0F;
  return out;
}

// Rows from above, so what lies left of an edge that runs to the right is above it.
double hill(double column) { return 30 - 6 * std::sin((column - 10) / 80 * 3.14159); }

TEST(EdgeStrip, FollowsWhereTheFacesBesideItChangePlacesAndEndsWhereTheEdgeDoes) {
  const EdgeStrip strip(kLevel, kLevel, {}, kReach, kGap);
  const auto costs = strip.costs(bad_where([](double c, double r) { return r > hill(c); }),
                                 bad_where([](double c, double r) { return r < hill(c); }));
  const std::vector<double> aside = strip.cheapest(costs, kPartLength, kNoBend);
  ASSERT_EQ(aside.size(), strip.size());
  EXPECT_EQ(aside.front(), 0);
  EXPECT_EQ(aside.back(), 0);
  for (std::size_t i = 0; i < aside.size(); ++i) EXPECT_NEAR(strip.at(i, aside[i]).y, hill(strip.at(i, 0).x), 1) << i;
}

TEST(EdgeStrip, TurnsLessTheMoreThatCosts) {
  const EdgeStrip strip(kLevel, kLevel, {}, kReach, kGap);
  const auto waves = [](double c) { return 30 + 3 * std::sin(c / 4); };
  const auto costs = strip.costs(bad_where([&](double c, double r) { return r > waves(c); }),
                                 bad_where([&](double c, double r) { return r < waves(c); }));
  const auto swing = [&](double bend) {
    const std::vector<double> aside = strip.cheapest(costs, kPartLength, bend);
    const auto [least, most] = std::minmax_element(aside.begin(), aside.end());
    return *most - *least;
  };
  EXPECT_GT(swing(kNoBend), 3);
  EXPECT_LT(swing(100), 1);
}

// Two edges that run side by side: each would like to have all that lies between them, and more.
TEST(EdgeStrip, LeavesTheGapToWhatOtherEdgesMayDo) {
  const Path upper{{10, 20}, {90, 20}}, lower{{10, 36}, {90, 36}};
  const auto all = bad_where([](double, double) { return true; }),
             none = bad_where([](double, double) { return false; });
  const std::vector<Path> beside_upper{lower}, beside_lower{upper};
  const EdgeStrip first(upper, upper, beside_upper, kReach, kGap), second(lower, lower, beside_lower, kReach, kGap);
  const std::vector<double> down = first.cheapest(first.costs(none, all), kPartLength, kNoBend);
  const std::vector<double> up = second.cheapest(second.costs(all, none), kPartLength, kNoBend);
  const auto lowest = [](const EdgeStrip& strip, const std::vector<double>& aside, std::size_t i) {
    return strip.at(i, aside[i]).y;
  };
  double nearest = 1e9, moved = 0;
  for (std::size_t i = 0; i < down.size(); ++i) {
    nearest = std::min(nearest, lowest(second, up, i) - lowest(first, down, i));
    moved = std::max(moved, lowest(first, down, i) - 20);
  }
  EXPECT_GT(moved, 4) << "it does go there";
  EXPECT_GE(nearest, kGap - 1.5) << "to a pixel and a half, which drawing on a raster may be wrong by";
}

TEST(EdgeStrip, GoesNoFartherFromWhereTheLayoutHasIt) {
  // The edge is where it went before, 8 pixels above, and would like to go on.
  const Path moved{{10, 30}, {18, 22}, {82, 22}, {90, 30}};
  const EdgeStrip strip(moved, kLevel, {}, kReach, kGap);
  const auto costs =
      strip.costs(bad_where([](double, double) { return true; }), bad_where([](double, double) { return false; }));
  const std::vector<double> aside = strip.cheapest(costs, kPartLength, kNoBend);
  double highest = 30;
  for (std::size_t i = 0; i < aside.size(); ++i) highest = std::min(highest, strip.at(i, aside[i]).y);
  EXPECT_NEAR(highest, 30 - kReach, 1.5);
}

TEST(EdgeStrip, TakesNothingThatIsForbidden) {
  const EdgeStrip strip(kLevel, kLevel, {}, kReach, kGap);
  // The face below would like to grow upwards, and may not above row 26.
  FaceCost left = bad_where([](double, double) { return true; }),
           right = bad_where([](double, double) { return false; });
  right.cost.rowRange(0, 26).setTo(kForbidden);
  const std::vector<double> aside = strip.cheapest(strip.costs(left, right), kPartLength, kNoBend);
  EXPECT_NEAR(*std::max_element(aside.begin(), aside.end()), 4, 0.6);
}

}  // namespace
}  // namespace veneer::planner
