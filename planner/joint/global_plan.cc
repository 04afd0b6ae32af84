#include "planner/joint/global_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "planner/joint/joint_journal.h"
#include "planner/joint/joint_search.h"
#include "planner/joint/packing.h"
#include "planner/joint/place_survey.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr double kSurveyShare = 0.4;  // of the time
// Iterations a patch: more gain little.
constexpr std::uint64_t kIterationsAPatch = 4000;
constexpr double kHot = 0.02, kCold = 0.0003;  // first and last temperature, in mean costs of a patch
constexpr std::uint64_t kLeg = 2048;           // iterations between reports and looks at the clock, at most
constexpr std::size_t kPlaces = 300;           // a patch, to choose from

// An arrangement whose costs are measured and whose outlines are all admitted.
struct Verified {
  Chosen places;              // costs weighed by importance
  std::vector<double> costs;  // as they are
  Score score;
};

class JointPlanner {
 public:
  JointPlanner(const Problem& problem, const Matcher& matcher, const std::vector<std::optional<Candidate>>& greedy,
               const PlanOptions& options, int threads, const JointProgress& progress, const std::stop_token& stop)
      : problem_(problem),
        matcher_(matcher),
        greedy_laid_(planner::laid(problem, matcher, greedy)),
        options_(options),
        threads_(threads),
        progress_(progress),
        stop_(stop) {
    for (const Problem::Task& task : problem.queue)
      footprints_.emplace_back(task.match.outline, options.kerf + FreeWood::kSlack);
    for (std::size_t i = 0; i < greedy.size(); ++i) {
      greedy_.places.emplace_back(), greedy_.costs.push_back(0);
      if (!greedy[i]) continue;
      greedy_.costs[i] = greedy[i]->cost;
      greedy_.places[i] = Place{footprints_[i].pose_of(greedy[i]->panel, greedy_laid_[i]->panel_from_artwork),
                                problem.queue[i].importance * greedy[i]->cost};
    }
    greedy_.score = score_of(greedy_.places);
    best_ = greedy_;
  }

  JointOutcome run(JointJournal journal) {
    GlobalReport report;
    report.greedy_cost = greedy_.score.cost, report.greedy_unfilled = greedy_.score.unfilled;
    report.budget = kIterationsAPatch * greedy_.places.size();
    if (std::optional<JointSearch> search = begun(journal)) improve(*search, journal, report);
    report.iterations = best_at_;
    report.stopped = report.iterations < report.budget;
    report.cost = best_.score.cost, report.unfilled = best_.score.unfilled;
    report.seconds = seconds_since(begin_);
    return {laid(), report};
  }

 private:
  // The search at its beginning, or where an earlier run left it. None once a stop is requested.
  std::optional<JointSearch> begun(JointJournal& journal) {
    JointSearch::State state;
    std::optional<JointSearch::Lists> lists = journal.lists(greedy_.places.size(), stop_);
    std::optional<JointSearch::State> remembered = lists ? journal.next_state(*lists) : std::nullopt;
    if (!remembered) {
      Start start = surveyed();
      if (stop_.stop_requested()) return std::nullopt;
      lists = std::move(start.lists), remembered = std::move(start.state);
      journal.add(*lists, stop_);
      if (stop_.stop_requested()) return std::nullopt;
      journal.add(*remembered);
    }
    for (; remembered; remembered = journal.next_state(*lists)) {
      state = std::move(*remembered);
      if (state.iteration > 0) settle_for(chosen_from(*lists, state.best), state.iteration);
    }
    return JointSearch(footprints_, matcher_.panels(), std::move(*lists), state, options_.seed);
  }

  struct Start {
    JointSearch::Lists lists;
    JointSearch::State state;
  };
  // Returns early, with anything, once a stop is requested.
  Start surveyed() const {
    Chosen start = greedy_.places;
    std::vector<Pose> slots;
    if (greedy_.score.unfilled > 0) slots = packed();
    progress_(0, "surveying the wood");
    Survey survey = survey_places(problem_, matcher_, footprints_, slots, {kPlaces, threads_}, stop_,
                                  [&](double share) { progress_(kSurveyShare * share, "surveying the wood"); });
    if (stop_.stop_requested()) return {};
    for (std::size_t i = 0; i < start.size(); ++i) {
      for (Place& place : survey.places[i]) place.cost *= problem_.queue[i].importance;
      for (Choice& choice : survey.slots[i]) choice.cost *= problem_.queue[i].importance;
    }
    if (!slots.empty()) {
      Chosen on_slots = each_on_a_slot(slots, survey.slots);
      if (score_of(on_slots).unfilled < greedy_.score.unfilled) start = std::move(on_slots);
    }
    Start out{std::move(survey.places), {}};
    for (std::size_t i = 0; i < start.size() && !stop_.stop_requested(); ++i) {
      std::vector<Place>& list = out.lists[i];
      for (const Choice& choice : survey.slots[i]) list.push_back({slots[choice.thing], choice.cost});
      for (const auto& place : {greedy_.places[i], start[i]})
        if (place) list.push_back(*place);
      std::sort(list.begin(), list.end(), cheaper);
      out.state.chosen.push_back(JointSearch::number_in(list, start[i]));
    }
    out.state.best = out.state.chosen;
    return out;
  }

  // Where the patches would fit if they were packed closely; all are taken as large as the largest.
  std::vector<Pose> packed() const {
    progress_(0, "packing the wood");
    Millimetres width, height;
    for (const Problem::Task& task : problem_.queue) {
      const Box<ArtworkFrame> box = bounds(task.match.outline);
      width = std::max(width, box.width()), height = std::max(height, box.height());
    }
    return pack_rectangles(matcher_, width, height, greedy_.places.size(), threads_, stop_);
  }

  // The cheapest assignment of patches to slots. Where slots are short, the first in the queue have them: to go without
  // costs more the earlier a patch is there, and by more than all places together differ.
  Chosen each_on_a_slot(const std::vector<Pose>& slots, const std::vector<std::vector<Choice>>& priced) const {
    const std::size_t count = greedy_.places.size();
    double most = 0;
    for (const auto& choices : priced)
      for (const Choice& choice : choices) most = std::max(most, choice.cost);
    std::vector<double> without;
    for (std::size_t i = 0; i < count; ++i)
      without.push_back(most * static_cast<double>(count) * static_cast<double>(2 * count - i));
    const auto taken = assign(priced, without, slots.size(), stop_);
    Chosen out(count);
    std::vector<bool> is_taken(slots.size());
    for (std::size_t i = 0; i < count; ++i) {
      if (!taken[i]) continue;
      const Choice& choice =
          *std::find_if(priced[i].begin(), priced[i].end(), [&](const Choice& it) { return it.thing == *taken[i]; });
      is_taken[choice.thing] = true;
      out[i] = Place{slots[choice.thing], choice.cost};
    }
    // Where others have all the cheapest, any slot.
    for (std::size_t i = 0, next = 0; i < count && !stop_.stop_requested(); ++i) {
      if (out[i]) continue;
      while (next < slots.size() && is_taken[next]) ++next;
      if (next == slots.size()) break;
      out[i] = Place{slots[next], problem_.queue[i].importance * measured(i, slots[next])};
      ++next;
    }
    return out;
  }

  void improve(JointSearch& search, JointJournal& journal, const GlobalReport& report) {
    const double filled = static_cast<double>(greedy_.places.size() - report.greedy_unfilled);
    const double mean = report.greedy_cost / std::max(1.0, filled);
    const Cooling cooling{kHot * mean, kCold * mean, report.budget};
    const std::uint64_t last =
        options_.optimize_iterations > 0 ? std::min(options_.optimize_iterations, report.budget) : report.budget;
    while (search.iteration() < last && !stop_.stop_requested()) {
      const std::uint64_t stage = cooling.next_stage(search.iteration());
      search.run(cooling, std::min({search.iteration() + kLeg, stage, last}), stop_);
      tell(search, static_cast<double>(search.iteration()) / static_cast<double>(last));
      const bool ends_stage = search.iteration() == stage, in_time = !out_of_time();
      if (ends_stage && search.iteration() < last) journal.add(search.state());
      if (ends_stage || search.iteration() == last || !in_time) settle_for(search.best(), search.iteration());
      if (!in_time) return;
    }
  }

  void tell(const JointSearch& search, double share) const {
    const Score& best = search.best_score();
    progress_(kSurveyShare + (1 - kSurveyShare) * share,
              best.unfilled > 0
                  ? fmt::format("optimising: {} patches are unfilled", best.unfilled)
                  : fmt::format("optimising: {:.1f} % below greedy", 100 * (1 - best.cost / greedy_.score.cost)));
  }

  bool out_of_time() const {
    return options_.optimize_seconds > 0 && seconds_since(begin_) >= options_.optimize_seconds;
  }

  // From now on `places`, found after so many iterations, is what this returns, if it is better and can be cut. All of
  // that is done while there is time, so that nothing is left to do once a stop is requested; then nothing changes.
  void settle_for(const Chosen& places, std::uint64_t iterations) {
    Verified better = with_costs(places);
    if (stop_.stop_requested()) return;
    // The search gets ever better by its own measure, which counts who goes without; here greedy is what matters.
    const bool settled = better.score < greedy_.score && keeps_to_the_wood(better.places);
    if (stop_.stop_requested()) return;
    if (settled) best_ = std::move(better);
    best_at_ = iterations;
  }

  double measured(std::size_t patch, const Pose& pose) const {
    const MatchPatch& match = problem_.queue[patch].match;
    return placement_cost(*match.features, match.grid, match.pixels,
                          matcher_.panels()[static_cast<std::size_t>(pose.panel)].features,
                          footprints_[patch].panel_from_artwork(pose));
  }

  Verified with_costs(const Chosen& places) const {
    Verified out{places, std::vector<double>(places.size()), {}};
    run_parallel(places.size(), threads_, stop_, [&](std::size_t i) {
      if (!places[i]) return;
      for (const Verified* known : {&best_, &greedy_})
        if (known->places[i] && known->places[i]->pose == places[i]->pose) {
          out.places[i] = known->places[i], out.costs[i] = known->costs[i];
          return;
        }
      out.costs[i] = measured(i, places[i]->pose);
      out.places[i]->cost = problem_.queue[i].importance * out.costs[i];
    });
    out.score = score_of(out.places);
    return out;
  }

  // The final word: every outline admitted one after the other, in the order of the queue.
  bool keeps_to_the_wood(const Chosen& chosen) const {
    std::vector<FreeWood> wood;
    for (const MatchPanel& panel : matcher_.panels()) wood.push_back(panel.wood.untouched());
    for (std::size_t i = 0; i < chosen.size() && !stop_.stop_requested(); ++i) {
      if (!chosen[i]) continue;
      const Pose& pose = chosen[i]->pose;
      const auto outline = footprints_[i].panel_from_artwork(pose) * problem_.queue[i].match.outline;
      FreeWood& there = wood[static_cast<std::size_t>(pose.panel)];
      if (!there.admits(outline)) return false;
      there.allocate(outline);
    }
    return true;
  }

  LaidPatches laid() const {
    LaidPatches out(best_.places.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (!best_.places[i]) continue;
      const Pose& pose = best_.places[i]->pose;
      // What greedy chose stays as it was, to the last bit.
      const bool kept = greedy_.places[i] && pose == greedy_.places[i]->pose;
      out[i] = kept ? greedy_laid_[i] : Laid{pose.panel, footprints_[i].panel_from_artwork(pose), best_.costs[i]};
    }
    return out;
  }

  const Problem& problem_;
  const Matcher& matcher_;
  LaidPatches greedy_laid_;
  const PlanOptions& options_;
  int threads_;
  const JointProgress& progress_;
  const std::stop_token& stop_;
  Clock::time_point begin_ = Clock::now();
  std::vector<Footprint> footprints_;
  Verified greedy_, best_;
  std::uint64_t best_at_ = 0;
};

}  // namespace

LaidPatches laid(const Problem& problem, const Matcher& matcher, const std::vector<std::optional<Candidate>>& chosen) {
  LaidPatches out;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    out.emplace_back();
    if (!chosen[i]) continue;
    const Candidate& it = *chosen[i];
    out.back() = Laid{it.panel, matcher.panel_from_artwork(problem.queue[i].match, it), it.cost};
  }
  return out;
}

JointOutcome plan_jointly(const Problem& problem, const Matcher& matcher,
                          const std::vector<std::optional<Candidate>>& greedy, const PlanOptions& options, int threads,
                          const JointProgress& progress, const std::stop_token& stop, PlanJournal* journal) {
  return JointPlanner(problem, matcher, greedy, options, threads, progress, stop).run(JointJournal(journal));
}

}  // namespace veneer::planner
