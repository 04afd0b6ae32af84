#include "planner/greedy/greedy.h"

#include <algorithm>

#include "planner/parallel.h"

namespace veneer::planner {
namespace {

// The place found on a state of the wood counts on any later state, as long as it is still free, because wood only
// becomes less. A place that was taken meanwhile is searched again. Who searches on which state depends on the queue
// alone, never on the number of threads.
class Greedy {
 public:
  Greedy(const Problem& problem, Matcher& matcher, int threads, const std::stop_token& stop, PlanJournal* journal,
         MaterialUse* use, LimitSet* closed)
      : queue_(problem.queue),
        limits_(problem.limits),
        use_(use),
        closed_(closed),
        matcher_(matcher),
        threads_(threads),
        stop_(stop),
        journal_(journal),
        answers_(problem.queue.size()),
        chosen_(problem.queue.size()) {}

  Result<std::vector<std::optional<LatticeCandidate>>> run(const std::function<void(std::size_t)>& on_placed) {
    while (placed_ < queue_.size()) {
      if (const Status searched = search_ahead(); !searched.ok()) return searched.error();
      accept();
      on_placed(placed_);
    }
    return std::move(chosen_);
  }

 private:
  // More of them would find more places taken: some 15 of 100 patches search again with 4, every other with 16.
  static constexpr std::size_t kAhead = 4;

  struct Answer {
    bool known = false;
    std::optional<LatticeCandidate> best;
  };

  bool is_free(std::size_t i) const { return matcher_.admits(queue_[i].match, *answers_[i].best); }

  Status search_ahead() {
    std::vector<std::size_t> open;
    for (std::size_t i = placed_; i < std::min(queue_.size(), placed_ + kAhead); ++i)
      if (!answers_[i].known || (answers_[i].best && !is_free(i))) open.push_back(i);
    PlanJournal::Step step;
    for (const std::size_t i : open) step.push_back({queue_[i].artwork, queue_[i].patch, {}});
    if (auto remembered = journal_ ? journal_->next(step) : std::nullopt) {
      step = std::move(*remembered);
    } else {
      Status done = run_parallel(open.size(), threads_, stop_, [&](std::size_t i) -> Status {
        const auto best = matcher_.best(queue_[open[i]].match, stop_);
        if (!best.ok()) return best.error();
        step[i].candidate = *best;
        return Ok();
      });
      if (!done.ok()) return done;
      if (journal_) journal_->add(step);
    }
    for (std::size_t i = 0; i < open.size(); ++i) answers_[open[i]] = {true, step[i].candidate};
    return unless_cancelled(stop_);
  }

  // Whether the patch may have the wood of its answer, which then counts as used. Otherwise such wood is closed to all
  // that follow, and so the answer is not free any more.
  bool within_limits(std::size_t i) {
    if (limits_.empty() || use_ == nullptr) return true;
    const MatchPatch& patch = queue_[i].match;
    const LatticeCandidate& best = *answers_[i].best;
    const LimitSet under = limits_.of(patch.outline, best.panel, matcher_.panel_from_artwork(patch, best));
    const SquareMillimetres area = area_of(patch.outline);
    const LimitSet refused = use_->refused(under, area);
    if (refused.empty()) {
      use_->add(under, area);
      return true;
    }
    for (std::size_t number = 0; number < limits_.size(); ++number) {
      if (!refused.has(number)) continue;
      for (const MaterialLimits::Wood& wood : limits_.wood_under(number)) matcher_.take(wood.panel, wood.outline);
    }
    // A bent piece may lie around the corner of a zone that its middle is in: the place itself is closed then, so that
    // the patch does not choose it for ever.
    if (is_free(i)) matcher_.take(patch, best);
    if (closed_ != nullptr) *closed_ = *closed_ | refused;
    return false;
  }

  void accept() {
    for (; placed_ < queue_.size() && answers_[placed_].known; ++placed_) {
      const Answer& answer = answers_[placed_];
      if (!answer.best) continue;
      if (!is_free(placed_) || !within_limits(placed_)) return;
      matcher_.take(queue_[placed_].match, *answer.best);
      chosen_[placed_] = answer.best;
    }
  }

  const std::vector<Problem::Task>& queue_;
  const MaterialLimits& limits_;
  MaterialUse* use_;
  LimitSet* closed_;
  Matcher& matcher_;
  int threads_;
  const std::stop_token& stop_;
  PlanJournal* journal_;
  std::size_t placed_ = 0;
  std::vector<Answer> answers_;
  std::vector<std::optional<LatticeCandidate>> chosen_;
};

}  // namespace

Result<std::vector<std::optional<LatticeCandidate>>> place_in_turn(const Problem& problem, Matcher& matcher,
                                                                   int threads, const std::stop_token& stop,
                                                                   const std::function<void(std::size_t)>& on_placed,
                                                                   PlanJournal* journal, MaterialUse* use,
                                                                   LimitSet* closed) {
  return Greedy(problem, matcher, threads, stop, journal, use, closed).run(on_placed);
}

}  // namespace veneer::planner
