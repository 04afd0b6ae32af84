// make_plan: from the problem and its index to the plan.
#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <tuple>

#include <fmt/format.h>

#include "planner/adaptive.h"
#include "planner/fine_rotation.h"
#include "planner/greedy.h"
#include "planner/joint/global_plan.h"
#include "planner/keep.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/parallel.h"
#include "planner/pictures/features.h"
#include "planner/plan.h"
#include "planner/plan_journal.h"
#include "planner/problem.h"
#include "planner/shared_work.h"
#include "planner/shortage.h"

namespace veneer::planner {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// Passes progress on, a few times a second and whenever something else begins: when the words before a ":" change.
class Reporter {
 public:
  explicit Reporter(const Progress& progress) : progress_(progress) {}
  void operator()(double fraction, const std::string& text) {
    if (!progress_) return;
    const std::string doing = text.substr(0, text.find(':'));
    if (doing == doing_ && seconds_since(last_) < 0.1) return;
    doing_ = doing, last_ = Clock::now();
    progress_(fraction, text);
  }

 private:
  const Progress& progress_;
  std::string doing_;
  Clock::time_point last_{};
};

std::unique_ptr<Matcher> make_matcher(Problem& problem, const PlanOptions& options) {
  if (options.exact)
    return std::make_unique<CertifiedMatcher>(std::move(problem.panels), turns(options.rotations), problem.classes,
                                              problem.entries_per_unit);
  return std::make_unique<ShortlistMatcher>(std::move(problem.panels), turns(options.rotations), problem.classes,
                                            largest_response(options));
}

// The matcher, when its index is to be kept on disk; the certified one's is not.
Result<ShortlistMatcher*> keep_index(Matcher& matcher, std::span<const StockPanel> stock, const PlanOptions& options) {
  auto* shortlist = dynamic_cast<ShortlistMatcher*>(&matcher);
  if (options.index_cache.empty() || shortlist == nullptr) return nullptr;
  Result<IndexCache> cache = IndexCache::open(options.index_cache);
  if (!cache.ok()) return cache.error();
  std::vector<std::string> names;
  for (const StockPanel& panel : stock) names.push_back(panel.id.value);
  shortlist->keep_index(std::move(*cache), std::move(names));
  return shortlist;
}

Plan describe(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options) {
  Plan plan;
  for (const Artwork& artwork : artworks)
    plan.artworks.push_back({artwork.name, artwork.letter, artwork.width, artwork.height});
  for (const StockPanel& panel : stock)
    plan.panels.push_back({panel.id, panel.picture.width(), panel.picture.height(), panel.picture.resolution.dpi()});
  plan.dpi = options.dpi;
  plan.kerf = options.kerf;
  return plan;
}

// Of the queue: artwork by artwork, row by row.
std::vector<std::size_t> reading_order(const Problem& problem) {
  std::vector<std::size_t> order(problem.queue.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto place = [&](const Problem::Task& task) {
      const Patch& patch = problem.artworks[task.artwork].patches[task.patch];
      return std::tuple(task.artwork, patch.row, patch.column);
    };
    return place(problem.queue[a]) < place(problem.queue[b]);
  });
  return order;
}

// The patches of the queue with wood as `laid` says.
void add_pieces(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const Problem& problem,
                const LaidPatches& laid, Plan& plan) {
  for (const std::size_t i : reading_order(problem)) {
    const Problem::Task& task = problem.queue[i];
    const Patch& patch = problem.artworks[task.artwork].patches[task.patch];
    Piece& piece = plan.pieces.emplace_back();
    piece.mark = mark_of(artworks[task.artwork].letter, patch);
    piece.artwork = task.artwork;
    piece.row = patch.row, piece.column = patch.column, piece.cells = patch.cells;
    piece.artwork_outline = patch.outline;
    piece.pixels = task.match.pixels.count;
    if (!laid[i]) continue;
    const auto panel = static_cast<std::size_t>(laid[i]->panel);
    const auto& panel_from_artwork = laid[i]->panel_from_artwork;
    piece.placement = Placement{stock[panel].id, panel_from_artwork, panel_from_artwork * patch.outline};
    piece.cost = laid[i]->cost;
  }
}

// Whoever moved pieces since they were placed, from now on the matcher knows what the plan takes.
void take_anew(Matcher& matcher, const Problem& problem, const LaidPatches& laid, int threads,
               const std::stop_token& stop) {
  matcher.give_back(threads, stop);
  for (std::size_t i = 0; i < laid.size() && !stop.stop_requested(); ++i)
    if (laid[i]) matcher.take(laid[i]->panel, laid[i]->panel_from_artwork * problem.queue[i].match.outline);
}

// `matcher` knows what the plan takes. Pieces are those of the queue, in reading order.
void add_alternatives(std::span<const StockPanel> stock, const Problem& problem, const Matcher& matcher,
                      std::size_t count, int threads, const std::stop_token& stop, Plan& plan) {
  const std::vector<std::size_t> order = reading_order(problem);
  run_parallel(order.size(), threads, stop, [&](std::size_t i) {
    const Problem::Task& task = problem.queue[order[i]];
    std::vector<Candidate> places = matcher.places(task.match, count, stop);
    std::sort(places.begin(), places.end());  // the shortlist's are in order but for its rounding
    for (const Candidate& place : places) {
      const auto panel_from_artwork = matcher.panel_from_artwork(task.match, place);
      plan.pieces[i].alternatives.push_back({{stock[static_cast<std::size_t>(place.panel)].id, panel_from_artwork,
                                              panel_from_artwork * task.match.outline},
                                             place.cost});
    }
  });
}

}  // namespace

Result<Plan> make_plan(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options,
                       const Progress& progress, std::stop_token stop, PlanJournal* journal, SharedWork* shared) {
  const Error cancelled{ErrorCode::kCancelled, "planning was cancelled"};
  constexpr double kIndexShare = 0.1;
  const double fine_share = options.fine_rotation ? 0.1 : 0;
  Reporter report(progress);
  const auto start = Clock::now();
  report(0, "reading the wood");
  Result<Problem> problem =
      make_problem(artworks, stock, options, stop, shared != nullptr ? &shared->saliency : nullptr);
  if (!problem.ok()) return problem.error();
  Result<KeptPatches> staying = keep_pieces(artworks, stock, options, *problem, stop);
  if (!staying.ok()) return staying.error();
  if (stop.stop_requested()) return cancelled;

  const int threads = threads_meant(options.threads);
  Plan plan = describe(artworks, stock, options);
  plan.warnings = std::move(problem->warnings);
  std::unique_ptr<Matcher> matcher =
      shared != nullptr ? shared->matcher_for(*problem, options, threads, stop) : nullptr;
  if (matcher == nullptr) {
    matcher = make_matcher(*problem, options);
    const Result<ShortlistMatcher*> kept = keep_index(*matcher, stock, options);
    if (!kept.ok()) return kept.error();
    report(0, "indexing the wood");  // whose own reports come from whatever the calling thread gets to do of it
    matcher->build_index(threads, stop, [&](double done) { report(kIndexShare * done, "indexing the wood"); });
    if (*kept != nullptr && (*kept)->not_kept()) plan.warnings.push_back((*kept)->not_kept()->message);
  }
  if (stop.stop_requested()) return cancelled;
  plan.seconds.features = seconds_since(start);

  const auto match_start = Clock::now();
  const std::size_t count = problem->queue.size() + problem->squares.size();
  // Of what the index leaves, greedy's part of the time.
  const double greedy_share = (1 - kIndexShare - fine_share) * (options.optimize == Optimize::kGlobal ? 0.2 : 1);
  const auto on_placed = [&](std::size_t placed) {
    report(kIndexShare + greedy_share * static_cast<double>(placed) / static_cast<double>(count),
           fmt::format("placing pieces: {} of {}", placed, count));
  };
  const auto chosen = problem->squares.empty() ? place_in_turn(*problem, *matcher, threads, stop, on_placed, journal)
                                               : place_squares(*problem, options.adaptive_factor, *matcher, threads,
                                                               stop, on_placed, journal);
  if (stop.stop_requested()) return cancelled;
  LaidPatches patches = laid(*problem, *matcher, chosen);
  if (options.optimize == Optimize::kGlobal && !problem->queue.empty()) {
    const double done = kIndexShare + greedy_share;
    JointOutcome joint = plan_jointly(
        *problem, *matcher, chosen, options, threads,
        [&](double share, const std::string& text) { report(done + (1 - fine_share - done) * share, text); }, stop,
        journal);
    patches = std::move(joint.patches);
    plan.global = joint.report;
  }
  plan.seconds.match = seconds_since(match_start);
  if (options.fine_rotation) {
    const auto fine_start = Clock::now();
    report(1 - fine_share, "turning pieces finely");
    FineOutcome fine = turn_finely(
        *problem, *matcher, std::move(patches), threads,
        [&](double share) { report(1 - fine_share * (1 - share), "turning pieces finely"); }, stop, journal);
    if (stop.stop_requested()) {
      if (!plan.global) return cancelled;
      plan.warnings.emplace_back("not all pieces are turned finely, because planning was stopped");
    }
    patches = std::move(fine.patches);
    plan.fine = fine.report;
    plan.seconds.refine = seconds_since(fine_start);
  }
  const std::optional<Shortage> shortage = shortage_of(*problem, *matcher, patches, options.patch, stop);
  if (options.alternatives > 0 && (plan.global || plan.fine)) take_anew(*matcher, *problem, patches, threads, stop);
  std::move(staying->tasks.begin(), staying->tasks.end(), std::back_inserter(problem->queue));
  std::move(staying->laid.begin(), staying->laid.end(), std::back_inserter(patches));
  add_pieces(artworks, stock, *problem, patches, plan);
  plan.shortage = shortage;
  if (options.alternatives > 0) {
    if (!stop.stop_requested()) add_alternatives(stock, *problem, *matcher, options.alternatives, threads, stop, plan);
    // The plan itself is whole: it is not thrown away for want of a list.
    if (stop.stop_requested()) {
      for (Piece& piece : plan.pieces) piece.alternatives.clear();
      plan.warnings.emplace_back("other places for the pieces are not listed, because planning was stopped");
    }
  }
  if (plan.shortage) plan.warnings.insert(plan.warnings.begin(), sentence_of(*plan.shortage, plan.pieces.size()));
  if (shared != nullptr) shared->keep(std::move(matcher), *problem, options);
  report(1, fmt::format("placed {} of {} pieces", plan.pieces.size() - unfilled(plan), plan.pieces.size()));
  return plan;
}

}  // namespace veneer::planner
