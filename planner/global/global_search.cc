#include "planner/global/global_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace veneer::planner {
namespace {

constexpr std::size_t kMostEjected = 3;
constexpr std::uint64_t kSteady = 256;  // iterations at one temperature
constexpr std::uint64_t kStages = 16;

}  // namespace

Score score_of(const Chosen& chosen) {
  Score score;
  for (const auto& candidate : chosen)
    if (candidate)
      score.cost += candidate->cost;
    else
      ++score.unfilled;
  return score;
}

std::uint32_t GlobalSearch::number_in(const std::vector<Candidate>& list, const std::optional<Candidate>& candidate) {
  if (!candidate) return kNone;
  return static_cast<std::uint32_t>(std::lower_bound(list.begin(), list.end(), *candidate, cheaper) - list.begin());
}

Chosen chosen_from(const GlobalSearch::Lists& lists, const std::vector<std::uint32_t>& numbers) {
  Chosen out(lists.size());
  for (std::size_t i = 0; i < lists.size(); ++i)
    if (numbers[i] != GlobalSearch::kNone) out[i] = lists[i][numbers[i]];
  return out;
}

GlobalSearch::GlobalSearch(std::span<const Footprint> footprints, const std::vector<MatchPanel>& panels, Lists lists,
                           const State& start, std::uint64_t seed, std::optional<SearchLimits> limits)
    : footprints_(footprints),
      lists_(std::move(lists)),
      arrangement_(footprints, panels),
      chosen_(chosen_from(lists_, start.chosen)),
      best_(chosen_from(lists_, start.best)),
      iteration_(start.iteration),
      seed_(seed),
      limits_(std::move(limits)) {
  for (std::size_t i = 0; i < chosen_.size(); ++i) count_use(i, {}, chosen_[i]);
  for (std::size_t i = 0; i < chosen_.size(); ++i)
    if (chosen_[i]) arrangement_.put(i, chosen_[i]->pose);
  for (const auto& list : lists_) blockers_.emplace_back(list.size());
  stays_.resize(lists_.size());
  for (const auto& list : lists_)
    if (!list.empty()) hole_cost_ = std::max(hole_cost_, 2 * list.back().cost);
  begin_stage();
}

// In [0, 1), the same everywhere (the standard's distributions are not).
double GlobalSearch::uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

void GlobalSearch::count_use(std::size_t patch, const std::optional<Candidate>& from,
                             const std::optional<Candidate>& to) {
  if (!limits_) return;
  if (from) limits_->others.remove(limit_at(*from), limits_->areas[patch]);
  if (to) limits_->others.add(limit_at(*to), limits_->areas[patch]);
}

void GlobalSearch::set(std::size_t patch, const std::optional<Candidate>& candidate) {
  count_use(patch, chosen_[patch], candidate);
  steps_.push_back({patch, chosen_[patch], stays_[patch]});
  chosen_[patch] = candidate;
  stays_[patch] = ++last_stay_;
  if (candidate)
    arrangement_.put(patch, candidate->pose);
  else
    arrangement_.remove(patch);
}

void GlobalSearch::undo() {
  // Backwards, and first everything off: a piece may return to where another one lies now.
  for (const Step& step : steps_) arrangement_.remove(step.patch);
  for (auto step = steps_.rbegin(); step != steps_.rend(); ++step) {
    count_use(step->patch, chosen_[step->patch], step->before);
    chosen_[step->patch] = step->before, stays_[step->patch] = step->stay_before;
  }
  for (const Step& step : steps_)
    if (chosen_[step.patch]) arrangement_.put(step.patch, chosen_[step.patch]->pose);
}

double Cooling::at(std::uint64_t iteration) const {
  return hot * std::pow(cold / hot, static_cast<double>(iteration) / static_cast<double>(iterations));
}

std::uint64_t Cooling::next_stage(std::uint64_t iteration) const {
  const std::uint64_t length = (iterations / kStages / kSteady + 1) * kSteady;
  return std::min(iterations, (iteration / length + 1) * length);
}

// Makes everything that decides what follows a function of the state alone.
void GlobalSearch::begin_stage() {
  random_.seed(seed_ ^ (iteration_ * 0x9E3779B97F4A7C15));
  score_ = score_with_holes(chosen_), best_score_ = score_with_holes(best());
}

Score GlobalSearch::score_with_holes(const Chosen& chosen) const {
  Score score = score_of(chosen);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    if (!chosen[i]) score.cost += hole_cost(i);
  return score;
}

void GlobalSearch::run(const Cooling& cooling, std::uint64_t to, const std::stop_token& stop) {
  for (; iteration_ < to && !stop.stop_requested(); ++iteration_) {
    if (cooling.begins_a_stage(iteration_)) begin_stage();
    if (iteration_ % kSteady == 0) temperature_ = cooling.at(iteration_);
    attempt(-temperature_ * std::log(1 - uniform()));
  }
}

GlobalSearch::State GlobalSearch::state() {
  State out{iteration_, {}, {}};
  for (std::size_t i = 0; i < lists_.size(); ++i) {
    out.chosen.push_back(number_in(lists_[i], chosen_[i]));
    out.best.push_back(number_in(lists_[i], best()[i]));
  }
  return out;
}

// One move, taken back when it costs more than `allowed`.
void GlobalSearch::attempt(double allowed) {
  const auto patch = static_cast<std::size_t>(uniform() * static_cast<double>(chosen_.size()));
  const std::vector<Candidate>& list = lists_[patch];
  if (list.empty()) return;
  // Places that alone cost too much are not worth asking about.
  const double mine = cost_now(patch), highest = mine + allowed;
  const auto end = std::lower_bound(list.begin(), list.end(), highest,
                                    [](const Candidate& candidate, double cost) { return candidate.cost < cost; });
  if (end == list.begin()) return;
  const double draw = uniform();
  const Candidate& wanted = list[static_cast<std::size_t>(draw * draw * static_cast<double>(end - list.begin()))];
  if (chosen_[patch] && chosen_[patch]->cost == wanted.cost) return;

  ejected_.clear();
  arrangement_.in_the_way(patch, wanted.pose, ejected_);
  if (ejected_.size() > kMostEjected) return;
  std::sort(ejected_.begin(), ejected_.end());  // so that nothing depends on how they came to lie there
  double left = allowed + mine - wanted.cost;
  for (const std::size_t other : ejected_) left += cost_now(other);
  // What the ejected cost at best.
  double least = 0;
  for (const std::size_t other : ejected_) least += lists_[other].empty() ? 0 : lists_[other].front().cost;
  if (least > left) return;

  steps_.clear();
  for (const std::size_t other : ejected_) set(other, std::nullopt);
  // Its own wood is given back before other wood is asked for.
  if (limits_ && chosen_[patch]) set(patch, std::nullopt);
  if (!has_room(patch, wanted)) return undo();
  set(patch, wanted);
  bool taken = true;
  for (std::size_t i = 0; i < ejected_.size() && taken; ++i) taken = refill(ejected_[i], left);
  if (!taken) return undo();
  accept();
}

// The best arrangement is copied only when it is left: improvements come in runs.
void GlobalSearch::accept() {
  Score score = score_;
  for (auto step = steps_.begin(); step != steps_.end(); ++step) {
    const bool first = std::none_of(steps_.begin(), step, [&](const Step& it) { return it.patch == step->patch; });
    if (!first) continue;
    score.cost += cost_now(step->patch) - cost_of(step->patch, step->before);
    if (!step->before) --score.unfilled;
    if (!chosen_[step->patch]) ++score.unfilled;
  }
  if (score < best_score_) {
    best_score_ = score, best_is_chosen_ = true;
  } else if (best_is_chosen_) {
    best_ = chosen_;
    for (auto step = steps_.rbegin(); step != steps_.rend(); ++step) best_[step->patch] = step->before;
    best_is_chosen_ = false;
  }
  score_ = score;
}

const Chosen& GlobalSearch::best() {
  if (best_is_chosen_) best_ = chosen_, best_is_chosen_ = false;
  return best_;
}

bool GlobalSearch::still_blocked(std::size_t patch, const Pose& pose, Blocker& blocker) const {
  const std::uint32_t other = blocker.patch;
  if (other == kNone) return false;
  if (blocker.stay == stays_[other]) return true;
  if (other == patch || !chosen_[other] ||
      !Footprint::overlap(footprints_[patch], pose, footprints_[other], chosen_[other]->pose))
    return false;
  blocker.stay = stays_[other];
  return true;
}

// The cheapest free candidate, if it costs at most `allowed`; takes its cost off.
bool GlobalSearch::refill(std::size_t patch, double& allowed) {
  for (std::size_t k = 0; k < lists_[patch].size(); ++k) {
    const Candidate& candidate = lists_[patch][k];
    if (candidate.cost > allowed) break;
    if (!has_room(patch, candidate)) continue;
    Blocker& blocker = blockers_[patch][k];
    if (still_blocked(patch, candidate.pose, blocker)) continue;
    if (const auto other = arrangement_.any_in_the_way(patch, candidate.pose)) {
      blocker = {static_cast<std::uint32_t>(*other), stays_[*other]};
      continue;
    }
    allowed -= candidate.cost;
    set(patch, candidate);
    return true;
  }
  if (hole_cost(patch) > allowed) return false;
  allowed -= hole_cost(patch);
  return true;
}

}  // namespace veneer::planner
