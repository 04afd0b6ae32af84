#include "planner/edits/alternatives.h"

#include <algorithm>
#include <utility>

#include "planner/parallel.h"
#include "planner/problem/taken_wood.h"

namespace veneer::planner {
namespace {

class AlternativeSearch {
 public:
  AlternativeSearch(std::span<const StockPanel> stock, const Problem& problem, Matcher& matcher,
                    const PatchPlacements& placements, std::size_t taken, std::size_t count, int threads,
                    const std::stop_token& stop)
      : stock_(stock),
        problem_(problem),
        matcher_(matcher),
        placements_(placements),
        taken_(taken),
        count_(count),
        threads_(threads),
        stop_(stop),
        use_(problem.limits),
        out_(problem.queue.size()) {
    if (problem.limits.empty()) return;
    for (std::size_t i = 0; i < placements.size(); ++i)
      if (placements[i]) use_.add(under(i, *placements[i]), area_of(problem.queue[i].match.outline));
  }

  Result<std::vector<std::vector<Alternative>>> run() {
    bool is_closed = false;  // wood that no piece has
    for (const auto& group : groups()) {
      const LimitSet& closed = group.first;
      const std::vector<std::size_t>& tasks = group.second;
      if (is_closed)
        if (Status open = take_anew(matcher_, problem_, std::span(placements_).first(taken_), threads_, stop_);
            !open.ok())
          return open.error();
      is_closed = !closed.empty();
      close(closed);
      const Status listed =
          run_parallel(tasks.size(), threads_, stop_, [&](std::size_t k) { return list(tasks[k], closed); });
      if (!listed.ok()) return listed.error();
    }
    return std::move(out_);
  }

 private:
  LimitSet under(std::size_t task, const PatchPlacement& placement) const {
    return problem_.limits.of(problem_.queue[task].match.outline, placement.panel, placement.panel_from_artwork);
  }

  // Limits whose wood a piece cannot have, with what it has now given back.
  LimitSet closed_to(std::size_t task) const {
    LimitSet out;
    if (problem_.limits.empty()) return out;
    const SquareMillimetres area = area_of(problem_.queue[task].match.outline);
    MaterialUse others = use_;
    if (placements_[task]) others.remove(under(task, *placements_[task]), area);
    for (std::size_t number = 0; number < problem_.limits.size(); ++number) {
      LimitSet one;
      one.add(number);
      out = out | others.refused(one, area);
    }
    return out;
  }

  // Tasks to which the same wood is closed, those to which none is first.
  std::vector<std::pair<LimitSet, std::vector<std::size_t>>> groups() const {
    std::vector<std::pair<LimitSet, std::vector<std::size_t>>> out{{LimitSet(), {}}};
    for (std::size_t task = 0; task < problem_.queue.size(); ++task) {
      const LimitSet closed = closed_to(task);
      auto group = std::ranges::find(out, closed, [](const auto& it) { return it.first; });
      if (group == out.end()) group = out.insert(out.end(), {closed, {}});
      group->second.push_back(task);
    }
    return out;
  }

  void close(LimitSet limits) {
    for (std::size_t number = 0; number < problem_.limits.size(); ++number) {
      if (!limits.has(number)) continue;
      for (const MaterialLimits::Wood& wood : problem_.limits.wood_under(number))
        matcher_.take(wood.panel, wood.outline);
    }
  }

  Status list(std::size_t task, LimitSet closed) {
    const MatchPatch& patch = problem_.queue[task].match;
    Result<std::vector<LatticeCandidate>> candidates = matcher_.candidates(patch, count_, stop_);
    if (!candidates.ok()) return candidates.error();
    std::sort(candidates->begin(), candidates->end());  // the shortlist's are in order but for its rounding
    for (const LatticeCandidate& candidate : *candidates) {
      const auto map = matcher_.panel_from_artwork(patch, candidate);
      // A bent piece may lie around the corner of a zone that its middle is in.
      if (problem_.limits.of(patch.outline, candidate.panel, map).meets(closed)) continue;
      out_[task].push_back({{stock_[static_cast<std::size_t>(candidate.panel)].id, map}, candidate.cost});
    }
    return Ok();
  }

  std::span<const StockPanel> stock_;
  const Problem& problem_;
  Matcher& matcher_;
  const PatchPlacements& placements_;
  std::size_t taken_, count_;
  int threads_;
  const std::stop_token& stop_;
  MaterialUse use_;
  std::vector<std::vector<Alternative>> out_;
};

}  // namespace

Result<std::vector<std::vector<Alternative>>> find_alternatives(std::span<const StockPanel> stock,
                                                                const Problem& problem, Matcher& matcher,
                                                                const PatchPlacements& placements, std::size_t taken,
                                                                std::size_t count, int threads,
                                                                const std::stop_token& stop) {
  return AlternativeSearch(stock, problem, matcher, placements, taken, count, threads, stop).run();
}

}  // namespace veneer::planner
