#include "planner/joint/global_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "planner/joint/joint_search.h"
#include "planner/joint/packing.h"
#include "planner/joint/place_survey.h"

namespace veneer::planner {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr double kSurveyShare = 0.4;  // of the time
// Iterations a patch: more gain little.
constexpr std::uint64_t kIterationsAPatch = 4000;
constexpr double kHot = 0.02, kCold = 0.0003;  // first and last temperature, in mean costs of a patch
constexpr std::uint64_t kLeg = 2048;           // iterations between looks at the clock
constexpr std::size_t kPlaces = 300;           // a patch, to choose from

class JointPlanner {
 public:
  JointPlanner(const Problem& problem, const Matcher& matcher, const std::vector<std::optional<Candidate>>& greedy,
               const PlanOptions& options, int threads, const JointProgress& progress)
      : problem_(problem),
        matcher_(matcher),
        greedy_(planner::laid(problem, matcher, greedy)),
        options_(options),
        threads_(threads),
        progress_(progress) {
    for (const Problem::Task& task : problem.queue)
      footprints_.emplace_back(task.match.outline, options.kerf + FreeWood::kSlack);
    for (std::size_t i = 0; i < greedy.size(); ++i) {
      start_.emplace_back();
      if (!greedy[i]) continue;
      start_.back() = Place{footprints_[i].pose_of(greedy[i]->panel, greedy_[i]->panel_from_artwork), 0};
    }
    measure(start_);
  }

  Chosen run(GlobalReport& report, const std::stop_token& stop) {
    const Score before = score_of(start_);
    report.greedy_cost = before.cost, report.greedy_unfilled = before.unfilled;
    report.budget = kIterationsAPatch * start_.size();
    Chosen chosen = improved(report, stop);
    report.stopped = report.iterations < report.budget;
    measure(chosen);
    if (!(score_of(chosen) < before) || !keeps_to_the_wood(chosen)) chosen = start_;
    report.cost = score_of(chosen).cost, report.unfilled = score_of(chosen).unfilled;
    report.seconds = seconds_since(begin_);
    return chosen;
  }

  LaidPatches laid(const Chosen& chosen) const {
    LaidPatches out(chosen.size());
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (!chosen[i]) continue;
      const Pose& pose = chosen[i]->pose;
      // What greedy chose stays as it was, to the last bit.
      const bool kept = start_[i] && pose == start_[i]->pose;
      out[i] = kept ? greedy_[i] : Laid{pose.panel, footprints_[i].panel_from_artwork(pose)};
    }
    return out;
  }

 private:
  Chosen improved(GlobalReport& report, const std::stop_token& stop) {
    std::vector<Pose> slots;
    if (report.greedy_unfilled > 0) slots = packed(stop);
    auto survey = survey_places(problem_, matcher_, footprints_, slots, {kPlaces, threads_}, stop,
                                [&](double share) { progress_(kSurveyShare * share, "surveying the wood"); });
    if (stop.stop_requested()) return start_;
    for (std::size_t i = 0; i < start_.size(); ++i) {
      for (Place& place : survey.slots[i]) place.cost *= problem_.queue[i].importance;
      std::vector<Place>& list = survey.places[i];
      for (Place& place : list) place.cost *= problem_.queue[i].importance;
      list.insert(list.end(), survey.slots[i].begin(), survey.slots[i].end());
      if (start_[i]) list.push_back(*start_[i]);
      std::sort(list.begin(), list.end(), cheaper);
    }
    Chosen start = start_;
    if (!slots.empty()) {
      Chosen on_slots = each_on_a_slot(slots, survey.slots);
      if (score_of(on_slots).unfilled < report.greedy_unfilled) start = std::move(on_slots);
    }
    JointSearch search(footprints_, matcher_.panels(), std::move(survey.places), start, options_.seed);
    anneal(search, report, stop);
    return search.best();
  }

  // Where the patches would fit if they were packed closely; all are taken as large as the largest.
  std::vector<Pose> packed(const std::stop_token& stop) const {
    Millimetres width, height;
    for (const Problem::Task& task : problem_.queue) {
      const Box<ArtworkFrame> box = bounds(task.match.outline);
      width = std::max(width, box.width()), height = std::max(height, box.height());
    }
    return pack_rectangles(matcher_, width, height, start_.size(), threads_, stop);
  }

  // In the order of the queue, each patch on the cheapest slot that is left.
  Chosen each_on_a_slot(const std::vector<Pose>& slots, const std::vector<std::vector<Place>>& priced) const {
    Arrangement arrangement(footprints_, matcher_.panels());
    Chosen out(start_.size());
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < out.size(); ++i) {
      for (const Place& place : priced[i])
        if (!arrangement.any_in_the_way(i, place.pose)) {
          out[i] = place;
          break;
        }
      if (out[i])
        arrangement.put(i, out[i]->pose);
      else
        left.push_back(i);
    }
    // Where all the cheapest are taken, any slot.
    std::size_t next = 0;
    for (const std::size_t i : left) {
      while (next < slots.size() && arrangement.any_in_the_way(i, slots[next])) ++next;
      if (next == slots.size()) break;
      out[i] = Place{slots[next], 0};
      arrangement.put(i, slots[next]);
    }
    measure(out);
    return out;
  }

  void anneal(JointSearch& search, GlobalReport& report, const std::stop_token& stop) {
    const double filled = static_cast<double>(start_.size() - report.greedy_unfilled);
    const double mean = report.greedy_cost / std::max(1.0, filled);
    const Cooling cooling{kHot * mean, kCold * mean, report.budget};
    const std::uint64_t last =
        options_.optimize_iterations > 0 ? std::min(options_.optimize_iterations, report.budget) : report.budget;
    while (report.iterations < last && !stop.stop_requested() && (report.iterations == 0 || !out_of_time())) {
      const std::uint64_t leg = std::min(report.iterations + kLeg, last);
      report.iterations = search.run(cooling, report.iterations, leg, stop);
      const Score& best = search.best_score();
      progress_(kSurveyShare + (1 - kSurveyShare) * static_cast<double>(report.iterations) / static_cast<double>(last),
                best.unfilled > 0
                    ? fmt::format("optimising: {} patches are unfilled", best.unfilled)
                    : fmt::format("optimising: {:.1f} % below greedy", 100 * (1 - best.cost / report.greedy_cost)));
    }
  }

  bool out_of_time() const {
    return options_.optimize_seconds > 0 && seconds_since(begin_) >= options_.optimize_seconds;
  }

  // Costs as they are measured at last, so that what is compared is what is reported.
  void measure(Chosen& chosen) const {
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (!chosen[i]) continue;
      const MatchPatch& match = problem_.queue[i].match;
      chosen[i]->cost = problem_.queue[i].importance *
                        placement_cost(*match.features, match.grid, match.pixels,
                                       matcher_.panels()[static_cast<std::size_t>(chosen[i]->pose.panel)].features,
                                       footprints_[i].panel_from_artwork(chosen[i]->pose));
    }
  }

  // The final word: every outline admitted one after the other, in the order of the queue.
  bool keeps_to_the_wood(const Chosen& chosen) const {
    std::vector<FreeWood> wood;
    for (const MatchPanel& panel : matcher_.panels()) wood.push_back(panel.wood.untouched());
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (!chosen[i]) continue;
      const Pose& pose = chosen[i]->pose;
      const auto outline = footprints_[i].panel_from_artwork(pose) * problem_.queue[i].match.outline;
      FreeWood& there = wood[static_cast<std::size_t>(pose.panel)];
      if (!there.admits(outline)) return false;
      there.allocate(outline);
    }
    return true;
  }

  const Problem& problem_;
  const Matcher& matcher_;
  LaidPatches greedy_;
  const PlanOptions& options_;
  int threads_;
  const JointProgress& progress_;
  Clock::time_point begin_ = Clock::now();
  std::vector<Footprint> footprints_;
  Chosen start_;
};

}  // namespace

LaidPatches laid(const Problem& problem, const Matcher& matcher, const std::vector<std::optional<Candidate>>& chosen) {
  LaidPatches out;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    out.emplace_back();
    if (chosen[i]) out.back() = Laid{chosen[i]->panel, matcher.panel_from_artwork(problem.queue[i].match, *chosen[i])};
  }
  return out;
}

JointOutcome plan_jointly(const Problem& problem, const Matcher& matcher,
                          const std::vector<std::optional<Candidate>>& greedy, const PlanOptions& options, int threads,
                          const JointProgress& progress, const std::stop_token& stop) {
  JointPlanner planner(problem, matcher, greedy, options, threads, progress);
  JointOutcome out;
  out.patches = planner.laid(planner.run(out.report, stop));
  return out;
}

}  // namespace veneer::planner
