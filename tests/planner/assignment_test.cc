#include "planner/joint/assignment.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

using Choices = std::vector<std::vector<Choice>>;

// All there are, one by one.
double least_cost(const Choices& choices, const std::vector<double>& without, std::vector<bool>& taken, std::size_t i) {
  if (i == choices.size()) return 0;
  double least = without[i] + least_cost(choices, without, taken, i + 1);
  for (const Choice& choice : choices[i]) {
    if (taken[choice.thing]) continue;
    taken[choice.thing] = true;
    least = std::min(least, choice.cost + least_cost(choices, without, taken, i + 1));
    taken[choice.thing] = false;
  }
  return least;
}

RC_GTEST_PROP(Assignment, CostsAsLittleAsAnyThatTakesNothingTwice, ()) {
  const auto takers = *rc::gen::inRange<std::size_t>(0, 7), things = *rc::gen::inRange<std::size_t>(1, 6);
  Choices choices(takers);
  std::vector<double> without;
  for (auto& mine : choices) {
    for (std::uint32_t thing = 0; thing < things; ++thing)
      if (*rc::gen::arbitrary<bool>()) mine.push_back({thing, *rc::gen::inRange(0, 30) / 10.0});
    without.push_back(*rc::gen::inRange(0, 60) / 10.0);
  }
  const auto taken = assign(choices, without, things, {});
  RC_ASSERT(taken.size() == takers);
  std::vector<bool> gone(things);
  double cost = 0;
  for (std::size_t i = 0; i < takers; ++i) {
    if (!taken[i]) {
      cost += without[i];
      continue;
    }
    const auto choice =
        std::find_if(choices[i].begin(), choices[i].end(), [&](const Choice& it) { return it.thing == *taken[i]; });
    RC_ASSERT(choice != choices[i].end());
    RC_ASSERT(!gone[choice->thing]);
    gone[choice->thing] = true, cost += choice->cost;
  }
  std::vector<bool> none(things);
  RC_ASSERT(std::abs(cost - least_cost(choices, without, none, 0)) < 1e-9);
}

TEST(Assignment, LeavesOutWhoseAbsenceCostsLeast) {
  const Choices choices{{{0, 1}}, {{0, 1}, {1, 5}}, {{1, 1}}};
  const auto taken = assign(choices, std::vector<double>{100, 300, 200}, 2, {});
  EXPECT_FALSE(taken[0].has_value());
  EXPECT_EQ(taken[1], 0U);
  EXPECT_EQ(taken[2], 1U);
}

TEST(Assignment, ReturnsEarlyOnceItIsStopped) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(assign(Choices{{{0, 1}}}, std::vector<double>{9}, 1, stop.get_token()).size(), 1U);
}

}  // namespace
}  // namespace veneer::planner
