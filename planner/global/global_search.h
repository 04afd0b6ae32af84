// Improves an assignment of candidates to patches by simulated annealing. A move puts a patch on a better candidate,
// ejects the patches that lie there and gives each of them its best free candidate.
//
// Iterations, not seconds, decide how long it runs, so results repeat bit for bit. The best arrangement seen is kept.
// Iterations come in stages; what lies between two stages is a State, from which another search goes on to the same
// result. One thread.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <stop_token>
#include <vector>

#include "planner/poses/arrangement.h"
#include "planner/problem/material_limits.h"

namespace veneer::planner {

// Where each patch lies; none: unfilled.
using Chosen = std::vector<std::optional<Candidate>>;

// First the number of filled patches counts, then the cost.
struct Score {
  std::size_t unfilled = 0;
  double cost = 0;
  friend bool operator<(const Score& a, const Score& b) {
    return a.unfilled < b.unfilled || (a.unfilled == b.unfilled && a.cost < b.cost);
  }
};
Score score_of(const Chosen& chosen);
// The candidates that numbers in the lists name.
Chosen chosen_from(const std::vector<std::vector<Candidate>>& lists, const std::vector<std::uint32_t>& numbers);

// Temperatures, in cost, fall evenly by factors over the iterations.
struct Cooling {
  double hot, cold;
  std::uint64_t iterations;
  double at(std::uint64_t iteration) const;
  // The first iteration of the stage after that of `iteration`.
  std::uint64_t next_stage(std::uint64_t iteration) const;
  bool begins_a_stage(std::uint64_t iteration) const {
    return iteration == 0 || next_stage(iteration - 1) == iteration;
  }
};

// What the patches of a search may take of limited woods.
struct SearchLimits {
  const MaterialLimits* limits = nullptr;
  std::vector<SquareMillimetres> areas;  // one a patch
  MaterialUse others;                    // by pieces that are no part of the search
};

class GlobalSearch {
 public:
  using Lists = std::vector<std::vector<Candidate>>;
  // Arrangements as numbers of candidates in the lists.
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();  // unfilled
  struct State {
    std::uint64_t iteration = 0;  // the next one: the first of a stage
    std::vector<std::uint32_t> chosen, best;
    friend bool operator==(const State&, const State&) = default;
  };

  // Of a candidate that is in the list.
  static std::uint32_t number_in(const std::vector<Candidate>& list, const std::optional<Candidate>& candidate);

  // `lists`: for each patch candidates on free wood, cheapest first. `start` must be free of overlaps. `limits`, if
  // given, are exceeded by no arrangement by more than `start` exceeds them.
  GlobalSearch(std::span<const Footprint> footprints, const std::vector<MatchPanel>& panels, Lists lists,
               const State& start, std::uint64_t seed, std::optional<SearchLimits> limits = {});

  // The next iterations of the cooling, up to number `to`, or until after the one under way when a stop is requested:
  // iteration() says how far it came, and everything stands as after that many.
  void run(const Cooling& cooling, std::uint64_t to, const std::stop_token& stop);

  std::uint64_t iteration() const { return iteration_; }  // the next one
  const Chosen& best();
  const Score& best_score() const { return best_score_; }  // its cost is with that of holes
  State state();
  const Lists& lists() const { return lists_; }

 private:
  // Who was in the way of a candidate last, and when: still so as long as that patch has not moved.
  struct Blocker {
    std::uint32_t patch = kNone;
    std::uint64_t stay = 0;
  };
  struct Step {
    std::size_t patch;
    std::optional<Candidate> before;
    std::uint64_t stay_before;
  };
  void begin_stage();
  void attempt(double allowed);
  bool refill(std::size_t patch, double& allowed);
  bool still_blocked(std::size_t patch, const Pose& pose, Blocker& blocker) const;
  void set(std::size_t patch, const std::optional<Candidate>& candidate);
  // Those of the wood at a candidate's middle.
  LimitSet limits_at(const Candidate& candidate) const {
    return limits_->limits->at(candidate.pose.panel, {Millimetres(candidate.pose.x), Millimetres(candidate.pose.y)});
  }
  bool has_room(std::size_t patch, const Candidate& candidate) const {
    return !limits_ || use_.has_room(limits_at(candidate), limits_->areas[patch]);
  }
  // From one place to the other, either of which may be none.
  void count_use(std::size_t patch, const std::optional<Candidate>& from, const std::optional<Candidate>& to);
  void accept();
  void undo();
  double uniform();
  // More than any candidate, and the more the earlier the patch is in the queue: where wood is missing, the holes
  // belong to the patches that matter least.
  double hole_cost(std::size_t patch) const {
    return hole_cost_ * (2 - static_cast<double>(patch) / static_cast<double>(lists_.size()));
  }
  double cost_of(std::size_t patch, const std::optional<Candidate>& candidate) const {
    return candidate ? candidate->cost : hole_cost(patch);
  }
  double cost_now(std::size_t patch) const { return cost_of(patch, chosen_[patch]); }
  Score score_with_holes(const Chosen& chosen) const;

  std::span<const Footprint> footprints_;
  Lists lists_;
  std::vector<std::vector<Blocker>> blockers_;  // one a candidate of the lists
  // Of each patch: another number whenever it moves, the old one when it is put back.
  std::vector<std::uint64_t> stays_;
  std::uint64_t last_stay_ = 0;
  Arrangement arrangement_;
  Chosen chosen_, best_;
  bool best_is_chosen_ = false;  // then best_ is out of date
  Score score_, best_score_;
  double hole_cost_ = 0, temperature_ = 0;
  std::uint64_t iteration_, seed_;
  std::mt19937_64 random_;
  std::optional<SearchLimits> limits_;
  MaterialUse use_;                   // with limits: by others and by what is chosen
  std::vector<Step> steps_;           // of the attempt under way
  std::vector<std::size_t> ejected_;  // by it
};

}  // namespace veneer::planner
