#include "planner/greedy/adaptive.h"

#include <map>

#include "planner/parallel.h"

namespace veneer::planner {
namespace {

// How many different candidates are looked at when the best one lies on a sibling's.
constexpr std::size_t kAlternatives = 8;

struct ChosenPatch {
  const Problem::Task* task = nullptr;
  std::optional<LatticeCandidate> candidate;  // none: no wood was left for it
};

// The sizes that one square of the layout is cut into.
class Square {
 public:
  Square(double factor, const Matcher& matcher, const std::stop_token& stop)
      : factor_(factor), matcher_(matcher), stop_(stop) {}

  Status ask(const TaskTree& square, int threads) {
    std::vector<const TaskTree*> nodes;
    collect(square, nodes);
    std::vector<std::optional<LatticeCandidate>> best(nodes.size());
    Status done = run_parallel(nodes.size(), threads, stop_, [&](std::size_t i) -> Status {
      const auto found = matcher_.best(nodes[i]->task.match, stop_);
      if (!found.ok()) return found.error();
      best[i] = *found;
      return Ok();
    });
    for (std::size_t i = 0; i < nodes.size(); ++i) best_[nodes[i]] = best[i];
    return done;
  }

  struct Choice {
    std::vector<ChosenPatch> patches;
    double cost = 0;  // weighed by importance
    bool whole = true;
  };
  // `siblings`: outlines that are spoken for, grown; what is chosen here is added.
  struct Taken {
    int panel;
    Ring<PanelFrame> grown;
  };
  Result<Choice> choose(const TaskTree& node, std::vector<Taken>& siblings) const {
    const Result<std::optional<LatticeCandidate>> beside = candidate_beside(node, siblings);
    if (!beside.ok()) return beside.error();
    const std::optional<LatticeCandidate> candidate = *beside;
    Choice as_one;
    as_one.patches.push_back({&node.task, candidate});
    as_one.whole = candidate.has_value();
    if (candidate) as_one.cost = weighed_cost(node, *candidate);
    std::vector<Taken> with_one = siblings;
    if (candidate) with_one.push_back(taken(node, *candidate));
    if (node.parts.empty()) {
      siblings = std::move(with_one);
      return as_one;
    }
    Choice parts;
    std::vector<Taken> with_parts = siblings;
    for (const TaskTree& part : node.parts) {
      const Result<Choice> choice = choose(part, with_parts);
      if (!choice.ok()) return choice.error();
      parts.cost += choice->cost;
      parts.whole = parts.whole && choice->whole;
      parts.patches.insert(parts.patches.end(), choice->patches.begin(), choice->patches.end());
    }
    const bool stays = candidate && (!parts.whole || as_one.cost <= factor_ * parts.cost);
    siblings = stays ? std::move(with_one) : std::move(with_parts);
    return stays ? as_one : parts;
  }

 private:
  static void collect(const TaskTree& node, std::vector<const TaskTree*>& nodes) {
    nodes.push_back(&node);
    for (const TaskTree& part : node.parts) collect(part, nodes);
  }

  Taken taken(const TaskTree& node, const LatticeCandidate& candidate) const {
    const auto outline = matcher_.panel_from_artwork(node.task.match, candidate) * node.task.match.outline;
    const FreeWood& wood = matcher_.panels()[static_cast<std::size_t>(candidate.panel)].wood;
    return {candidate.panel, grown(outline, wood.kerf() + FreeWood::kSlack)};
  }

  bool clear_of(const Taken& wanted, const std::vector<Taken>& siblings) const {
    for (const Taken& other : siblings)
      if (other.panel == wanted.panel && convex_overlap(other.grown, wanted.grown)) return false;
    return true;
  }

  Result<std::optional<LatticeCandidate>> candidate_beside(const TaskTree& node,
                                                           const std::vector<Taken>& siblings) const {
    const std::optional<LatticeCandidate>& best = best_.at(&node);
    if (!best || clear_of(taken(node, *best), siblings)) return best;
    const auto others = matcher_.candidates(node.task.match, kAlternatives, stop_);
    if (!others.ok()) return others.error();
    for (const LatticeCandidate& other : *others)
      if (clear_of(taken(node, other), siblings)) return std::optional(other);
    return std::optional<LatticeCandidate>();
  }

  // Cell by cell, so that a large patch is judged by how well it serves what matters in it.
  double weighed_cost(const TaskTree& node, const LatticeCandidate& candidate) const {
    if (node.parts.empty()) return node.task.importance * matcher_.exact_cost(node.task.match, candidate);
    double sum = 0;
    for (const TaskTree& part : node.parts) {
      LatticeCandidate same_motion = candidate;
      same_motion.x += part.task.match.pixels.left - node.task.match.pixels.left;
      same_motion.y += part.task.match.pixels.top - node.task.match.pixels.top;
      sum += weighed_cost(part, same_motion);
    }
    return sum;
  }

  double factor_;
  const Matcher& matcher_;
  const std::stop_token& stop_;
  std::map<const TaskTree*, std::optional<LatticeCandidate>> best_;
};

// Decides one square and takes its wood. kCancelled: a stop was requested.
Result<std::vector<ChosenPatch>> choose_sizes(const TaskTree& square, double factor, Matcher& matcher, int threads,
                                              const std::stop_token& stop) {
  Square search(factor, matcher, stop);
  if (const Status asked = search.ask(square, threads); !asked.ok()) return asked.error();
  std::vector<Square::Taken> nothing_yet;
  Result<Square::Choice> choice = search.choose(square, nothing_yet);
  if (!choice.ok()) return choice.error();
  for (ChosenPatch& patch : choice->patches) {
    // Alternatives came from a short list: on wood that is nearly used up another look may find more.
    if (!patch.candidate || !matcher.admits(patch.task->match, *patch.candidate)) {
      const auto best = matcher.best(patch.task->match, stop);
      if (!best.ok()) return best.error();
      patch.candidate = *best;
    }
    if (patch.candidate) matcher.take(patch.task->match, *patch.candidate);
  }
  return std::move(choice->patches);
}

const TaskTree* find_patch(const TaskTree& square, std::size_t patch) {
  if (square.task.patch == patch) return &square;
  for (const TaskTree& part : square.parts)
    if (const TaskTree* found = find_patch(part, patch)) return found;
  return nullptr;
}

// What an earlier run chose for this square: the square itself, then its patches. Takes its wood.
std::vector<ChosenPatch> remembered(const TaskTree& square, PlanJournal& journal, Matcher& matcher) {
  std::vector<ChosenPatch> chosen;
  const auto step = journal.next({{square.task.artwork, square.task.patch, {}}});
  for (std::size_t i = 1; step && i < step->size(); ++i) {
    const TaskTree* node = find_patch(square, (*step)[i].patch);
    if (!node) return {};
    chosen.push_back({&node->task, (*step)[i].candidate});
  }
  for (const ChosenPatch& patch : chosen)
    if (patch.candidate) matcher.take(patch.task->match, *patch.candidate);
  return chosen;
}

void remember(const TaskTree& square, const std::vector<ChosenPatch>& chosen, PlanJournal& journal) {
  PlanJournal::Step step{{square.task.artwork, square.task.patch, {}}};
  for (const ChosenPatch& patch : chosen) step.push_back({patch.task->artwork, patch.task->patch, patch.candidate});
  journal.add(step);
}

}  // namespace

Result<std::vector<std::optional<LatticeCandidate>>> place_squares(Problem& problem, double factor, Matcher& matcher,
                                                                   int threads, const std::stop_token& stop,
                                                                   const std::function<void(std::size_t)>& on_placed,
                                                                   PlanJournal* journal) {
  std::vector<std::optional<LatticeCandidate>> candidates;
  for (std::size_t done = 0; done < problem.squares.size();) {
    if (stop.stop_requested()) return cancelled();
    const TaskTree& square = problem.squares[done];
    std::vector<ChosenPatch> chosen;
    if (journal) chosen = remembered(square, *journal, matcher);
    if (chosen.empty()) {
      Result<std::vector<ChosenPatch>> sizes = choose_sizes(square, factor, matcher, threads, stop);
      if (!sizes.ok()) return sizes.error();
      chosen = std::move(*sizes);
      if (journal) remember(square, chosen, *journal);
    }
    for (const ChosenPatch& patch : chosen) {
      problem.queue.push_back(*patch.task);
      candidates.push_back(patch.candidate);
    }
    on_placed(++done);
  }
  return candidates;
}

}  // namespace veneer::planner
