// Improves who takes which place: simulated annealing whose moves put a patch on a better place, eject the patches that
// lie in its way and give each of them its best free place.
//
// Iterations, not seconds, decide how long it runs, so results repeat bit for bit. The best arrangement seen is kept.
// One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <stop_token>
#include <vector>

#include "planner/joint/arrangement.h"

namespace veneer::planner {

// Where each patch lies; none: unfilled.
using Chosen = std::vector<std::optional<Place>>;

// Unfilled patches weigh more than any place: first the number of filled patches counts, then the cost.
struct Score {
  std::size_t unfilled = 0;
  double cost = 0;
  friend bool operator<(const Score& a, const Score& b) {
    return a.unfilled < b.unfilled || (a.unfilled == b.unfilled && a.cost < b.cost);
  }
};
Score score_of(const Chosen& chosen);

// Temperatures, in cost, fall evenly by factors over the iterations.
struct Cooling {
  double hot, cold;
  std::uint64_t iterations;
  double at(std::uint64_t iteration) const;
};

class JointSearch {
 public:
  // `lists`: for each patch places on free wood, cheapest first. `start` must be free of overlaps.
  JointSearch(std::span<const Footprint> footprints, const std::vector<MatchPanel>& panels,
              std::vector<std::vector<Place>> lists, const Chosen& start, std::uint64_t seed);

  // Iterations number `from` to `to` of the cooling. Returns the number of the next one, early once `stop` is
  // requested.
  std::uint64_t run(const Cooling& cooling, std::uint64_t from, std::uint64_t to, const std::stop_token& stop);

  const Chosen& best();
  const Score& best_score() const { return best_score_; }

 private:
  struct Step {
    std::size_t patch;
    std::optional<Place> before;
  };
  void attempt(double allowed);
  bool refill(std::size_t patch, double& allowed);
  void set(std::size_t patch, const std::optional<Place>& place);
  void accept();
  void undo();
  double uniform();
  double cost_of(const std::optional<Place>& place) const { return place ? place->cost : unfilled_cost_; }

  std::span<const Footprint> footprints_;
  std::vector<std::vector<Place>> lists_;
  std::vector<std::vector<std::uint32_t>> blockers_;  // for each place who was in the way last: asked first
  Arrangement arrangement_;
  Chosen chosen_, best_;
  bool best_is_chosen_ = false;  // then best_ is out of date
  Score score_, best_score_;
  double unfilled_cost_ = 0, temperature_ = 0;
  std::mt19937_64 random_;
  std::vector<Step> steps_;           // of the attempt under way
  std::vector<std::size_t> ejected_;  // by it
};

}  // namespace veneer::planner
