#include "planner/joint/assignment.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace veneer::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

// One after the other gets a thing by the cheapest chain of takers that change theirs. Prices (dual variables) keep
// every choice at or above zero and those that are taken at zero, so that each search is Dijkstra's.
class Assignment {
 public:
  Assignment(std::span<const std::vector<Choice>> choices, std::span<const double> without, std::size_t things,
             const std::stop_token& stop)
      : choices_(choices),
        without_(without),
        stop_(stop),
        taken_(choices.size()),
        paid_(choices.size(), 0),
        taker_(things, kNobody),
        price_(things, 0),
        distance_(things, kInfinity),
        is_settled_(things),
        from_(things, kNobody) {}

  void add(std::uint32_t newcomer) {
    reached_.clear(), settled_.clear(), open_ = {};
    double least = without_[newcomer];        // of all chains known so far
    std::optional<std::uint32_t> free_thing;  // where it ends, or
    std::uint32_t leaves = newcomer;          // who goes without
    reach_from(newcomer, 0);
    while (!open_.empty() && open_.top().first < least && !stop_.stop_requested()) {
      const auto [distance, thing] = open_.top();
      open_.pop();
      if (distance > distance_[thing]) continue;  // reached by a shorter way since
      const std::uint32_t owner = taker_[thing];
      if (owner == kNobody) {
        least = distance, free_thing = thing;
        break;
      }
      settled_.push_back(thing), is_settled_[thing] = true;
      if (distance + without_[owner] - paid_[owner] < least)
        least = distance + without_[owner] - paid_[owner], leaves = owner;
      reach_from(owner, distance - paid_[owner]);
    }
    for (const std::uint32_t thing : settled_) {
      price_[thing] += distance_[thing] - least;
      paid_[taker_[thing]] += least - distance_[thing];
    }
    paid_[newcomer] = least;
    pass_on(newcomer, leaves, free_thing);
    for (const std::uint32_t thing : reached_) distance_[thing] = kInfinity, is_settled_[thing] = false;
  }

  std::vector<std::optional<std::uint32_t>> taken() && { return std::move(taken_); }

 private:
  void reach_from(std::uint32_t who, double distance) {
    for (const Choice& choice : choices_[who]) {
      const double there = distance + choice.cost - price_[choice.thing];
      // What is settled stays, whatever rounding says.
      if (is_settled_[choice.thing] || !(there < distance_[choice.thing])) continue;
      if (distance_[choice.thing] == kInfinity) reached_.push_back(choice.thing);
      distance_[choice.thing] = there, from_[choice.thing] = who;
      open_.emplace(there, choice.thing);
    }
  }

  // Along the chain, backwards from its end.
  void pass_on(std::uint32_t newcomer, std::uint32_t leaves, std::optional<std::uint32_t> thing) {
    if (!thing) thing = std::exchange(taken_[leaves], std::nullopt);
    if (!thing) return;  // the newcomer itself
    for (std::uint32_t who = kNobody; who != newcomer;) {
      who = from_[*thing];
      taker_[*thing] = who;
      thing = std::exchange(taken_[who], thing);
    }
  }

  std::span<const std::vector<Choice>> choices_;
  std::span<const double> without_;
  const std::stop_token& stop_;
  std::vector<std::optional<std::uint32_t>> taken_;
  std::vector<double> paid_;  // by each taker
  std::vector<std::uint32_t> taker_;
  std::vector<double> price_;  // of each thing, at most 0
  // Of the search under way:
  std::vector<double> distance_;
  std::vector<bool> is_settled_;
  std::vector<std::uint32_t> from_, reached_, settled_;
  std::priority_queue<std::pair<double, std::uint32_t>, std::vector<std::pair<double, std::uint32_t>>, std::greater<>>
      open_;
};

}  // namespace

std::vector<std::optional<std::uint32_t>> assign(std::span<const std::vector<Choice>> choices,
                                                 std::span<const double> without, std::size_t things,
                                                 const std::stop_token& stop) {
  Assignment assignment(choices, without, things, stop);
  for (std::uint32_t i = 0; i < choices.size() && !stop.stop_requested(); ++i) assignment.add(i);
  return std::move(assignment).taken();
}

}  // namespace veneer::planner
