// make_plan: from the problem and its index to the plan.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "planner/boundaries/refinement.h"
#include "planner/edits/alternatives.h"
#include "planner/edits/kept_pieces.h"
#include "planner/files/plan_journal.h"
#include "planner/global/global_plan.h"
#include "planner/greedy/adaptive.h"
#include "planner/greedy/greedy.h"
#include "planner/layout/fabrication.h"
#include "planner/layout/mosaic.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/parallel.h"
#include "planner/pictures/features.h"
#include "planner/plan.h"
#include "planner/poses/fine_rotation.h"
#include "planner/problem/material_shares.h"
#include "planner/problem/problem.h"
#include "planner/problem/shared_work.h"
#include "planner/problem/shortage.h"
#include "planner/problem/taken_wood.h"
#include "planner/stopwatch.h"

namespace veneer::planner {
namespace {

// Passes progress on, a few times a second and whenever something else begins: when the words before a ":" change.
class Reporter {
 public:
  explicit Reporter(const Progress& progress) : progress_(progress) {}
  void operator()(double fraction, const std::string& text) {
    if (!progress_) return;
    const std::string doing = text.substr(0, text.find(':'));
    if (doing == doing_ && last_.seconds() < 0.1) return;
    doing_ = doing, last_ = {};
    progress_(fraction, text);
  }

 private:
  const Progress& progress_;
  std::string doing_;
  Stopwatch last_;
};

std::unique_ptr<Matcher> make_matcher(Problem& problem, const PlanOptions& options) {
  if (options.exact)
    return std::make_unique<CertifiedMatcher>(std::move(problem.panels), turns(options.rotations), problem.classes,
                                              problem.entries_per_unit);
  return std::make_unique<ShortlistMatcher>(std::move(problem.panels), turns(options.rotations), problem.classes,
                                            largest_response(options), options.thoroughness);
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

// Options that were given and change nothing.
void add_idle_options(const PlanOptions& options, std::vector<std::string>& warnings) {
  if (options.w_gamut > 0 && options.w_colour <= 0)
    warnings.emplace_back(
        "colours are not mapped to the wood's, because the colour weight is 0: raise it (--w-colour)");
  if (options.triangles && options.layout != LayoutKind::kMorph)
    warnings.emplace_back(
        "no cell is cut into triangles, because only a morphed grid's are: choose that layout (--layout morph)");
  if (options.cell_aspect > 1 && options.layout != LayoutKind::kMosaic)
    warnings.emplace_back(
        "no cell is longer than wide, because only a mosaic's are: choose that layout (--layout mosaic)");
  if (options.flow_lines_only && options.layout != LayoutKind::kMosaic)
    warnings.emplace_back(
        "no cell lies along flow lines, because only a mosaic's do: choose that layout (--layout mosaic)");
  const bool chosen_together =
      options.optimize == Optimize::kGlobal || (options.refine != Refine::kNone && options.rematch > 0);
  if (options.w_grain > 0 && !chosen_together)
    warnings.emplace_back(
        "the grain does not count, because pieces choose in turn: let them choose together "
        "(--optimize global)");
}

// Of the queue: artwork by artwork, row by row.
std::vector<std::size_t> reading_order(const Problem& problem) {
  std::vector<std::size_t> order(problem.queue.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto place = [&](const Problem::Task& task) {
      const Patch& patch = problem.artworks[task.artwork].patches[task.patch];
      return std::tuple(task.artwork, patch.number, patch.row, patch.column);
    };
    return place(problem.queue[a]) < place(problem.queue[b]);
  });
  return order;
}

// The patches of the queue with wood as `placements` says.
void add_pieces(std::span<const StockPanel> stock, const Problem& problem, const PatchPlacements& placements,
                Plan& plan) {
  for (const std::size_t i : reading_order(problem)) {
    const Problem::Task& task = problem.queue[i];
    const Patch& patch = problem.artworks[task.artwork].patches[task.patch];
    Piece& piece = plan.pieces.emplace_back();
    piece.mark = problem.marks.of(task.artwork, patch);
    piece.artwork = task.artwork;
    const bool has_rows = patch.number == Patch::kInGrid;
    piece.row = has_rows ? patch.row : Piece::kNoRow, piece.column = has_rows ? patch.column : Piece::kNoRow;
    piece.cells = patch.cells;
    piece.artwork_outline = patch.outline;
    piece.pixels = task.match.pixels.count;
    if (!placements[i]) continue;
    const auto panel = static_cast<std::size_t>(placements[i]->panel);
    piece.placement = Placement{stock[panel].id, placements[i]->panel_from_artwork};
    piece.cost = placements[i]->cost;
  }
}

// Faces as add_pieces() adds their pieces.
std::vector<Partition> in_reading_order(const Problem& problem, const Refinement& refined) {
  std::vector<std::size_t> place(problem.queue.size());
  const std::vector<std::size_t> order = reading_order(problem);
  for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  std::vector<Partition> out;
  for (std::size_t a = 0; a < refined.layouts.size(); ++a) {
    std::vector<std::size_t> faces(refined.faces[a].size());
    std::iota(faces.begin(), faces.end(), std::size_t{0});
    std::sort(faces.begin(), faces.end(),
              [&](std::size_t f, std::size_t g) { return place[refined.faces[a][f]] < place[refined.faces[a][g]]; });
    out.push_back(with_faces(refined.layouts[a], faces));
  }
  return out;
}

// Whether a plan has more than straight grids.
bool has_layouts(const Problem& problem, const PlanOptions& options) {
  return !options.kept_layouts.empty() || std::any_of(problem.artworks.begin(), problem.artworks.end(),
                                                      [](const WorkingArtwork& it) { return it.layout.has_value(); });
}

// Of the artworks that an earlier plan had, and of those that are planned beside them.
std::vector<Partition> layouts_of(const Problem& problem, const PlanOptions& options, const Plan& plan) {
  std::vector<Partition> out;
  for (std::size_t a = 0; a < plan.artworks.size(); ++a) {
    const PlanArtwork& artwork = plan.artworks[a];
    const auto kept = std::find_if(options.kept_layouts.begin(), options.kept_layouts.end(),
                                   [&](const KeptLayout& it) { return it.letter == artwork.letter; });
    if (kept != options.kept_layouts.end()) {
      out.push_back(kept->layout);
      continue;
    }
    if (problem.artworks[a].layout) {
      out.push_back(*problem.artworks[a].layout);
      continue;
    }
    std::vector<Patch> patches;
    for (const std::size_t i : reading_order(problem))
      if (const Problem::Task& task = problem.queue[i]; task.artwork == a)
        patches.push_back(problem.artworks[a].patches[task.patch]);
    out.push_back(partition_of(artwork.width, artwork.height, patches));
  }
  return out;
}

// To pieces as add_pieces() adds them; see find_alternatives().
Status add_alternatives(std::span<const StockPanel> stock, const Problem& problem, Matcher& matcher,
                        const PatchPlacements& placements, std::size_t taken, const PlanOptions& options, int threads,
                        const std::stop_token& stop, Plan& plan) {
  auto places = find_alternatives(stock, problem, matcher, placements, taken, options.alternatives, threads, stop);
  if (!places.ok()) return places.error();
  const std::vector<std::size_t> order = reading_order(problem);
  for (std::size_t i = 0; i < order.size(); ++i) plan.pieces[i].alternatives = std::move((*places)[order[i]]);
  return Ok();
}

SquareMillimetres least_area(const PlanOptions& options) {
  return std::max(options.min_width * options.min_width * kHandyArea, options.min_size * options.min_size);
}

// Of every layout, squares too: whoever asks for small pieces has them, but is told.
void note_unfit_pieces(const PlanOptions& options, int threads, Plan& plan) {
  constexpr std::size_t kNamed = 8;              // in the warning
  constexpr SquareMillimetres kRounding{0.001};  // of a square of just that size, cut from a whole picture
  const FabricationLimits limits{options.min_width, std::max(options.min_width * options.min_width * kHandyArea,
                                                             options.min_size * options.min_size - kRounding)};
  std::vector<std::optional<FabricationFault>> faults(plan.pieces.size());
  (void)run_parallel(faults.size(), threads, {},
                     [&](std::size_t i) { faults[i] = fault_of(plan.pieces[i].artwork_outline, limits); });
  std::string names;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (!faults[i]) continue;
    plan.unfit.push_back({plan.pieces[i].mark, std::string(words_for(*faults[i]))});
    if (plan.unfit.size() > kNamed) continue;
    names += fmt::format("{}{} {}", names.empty() ? "" : ", ", plan.unfit.back().mark, plan.unfit.back().why);
  }
  if (plan.unfit.empty()) return;
  if (plan.unfit.size() > kNamed) names += fmt::format(" and {} more", plan.unfit.size() - kNamed);
  plan.warnings.push_back(
      fmt::format("{} pieces are thinner than {} mm or smaller than a square of {:.4g} mm: {}; choose larger patches, "
                  "or a smaller --min-width-mm or --min-size-mm if you can handle them",
                  plan.unfit.size(), limits.width.count(), std::sqrt(limits.area.count()), names));
}

// Cells that lie askew whatever is done, since the directions turn within them. Photographs have one in seven, where
// lines end or cross.
void note_turning_cells(const MosaicReport& report, std::span<const Artwork> artworks,
                        std::vector<std::string>& warnings) {
  constexpr double kUsual = 0.2;  // of the cells
  constexpr std::size_t kNamed = 4;
  std::size_t cells = 0;
  std::string places;
  for (std::size_t i = 0; i < report.turning.size(); ++i) {
    const MosaicReport::Turning& it = report.turning[i];
    cells += it.cells;
    if (i >= kNamed) continue;
    places += fmt::format("{}{} at the {}", i == 0 ? "" : ", ", it.cells, it.where);
    if (artworks.size() > 1) places += fmt::format(" of \"{}\"", artworks[it.artwork].name);
  }
  if (static_cast<double>(cells) <= kUsual * static_cast<double>(report.tiles)) return;
  warnings.push_back(
      fmt::format("within {} of {} cells the directions turn by {:g} degrees or more, so that these lie along none of "
                  "them: {}{}; choose smaller patches, or cells that are small there (--cell-sizes), or simpler lines "
                  "for them (--flow-lines)",
                  cells, report.tiles, kTurningDegrees, places, report.turning.size() > kNamed ? ", ..." : ""));
}

// Areas that were drawn and are no pieces.
void note_merged_areas(const SegmentationReport& report, std::span<const Artwork> artworks, const PlanOptions& options,
                       std::vector<std::string>& warnings) {
  constexpr std::size_t kNamed = 8;
  if (report.merged.empty()) return;
  std::string places;
  for (std::size_t i = 0; i < std::min(kNamed, report.merged.size()); ++i) {
    const SegmentationReport::Merged& it = report.merged[i];
    places += fmt::format("{}{:.2f} mm2 at {:.1f}, {:.1f} mm", i == 0 ? "" : ", ", it.area.count(), it.at.x.count(),
                          it.at.y.count());
    if (artworks.size() > 1) places += fmt::format(" of \"{}\"", artworks[it.artwork].name);
  }
  if (report.merged.size() > kNamed) places += fmt::format(" and {} more", report.merged.size() - kNamed);
  warnings.push_back(fmt::format(
      "{} of {} areas that were drawn are no pieces but went to their neighbours, smaller than a square of {:.4g} mm "
      "or "
      "thinner than {} mm: {} from the lower left corner; draw them larger, or choose a smaller --min-size-mm or "
      "--min-width-mm",
      report.merged.size(), report.areas, std::sqrt(least_area(options).count()), options.min_width.count(), places));
}

}  // namespace

Result<Plan> make_plan(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options,
                       const Progress& progress, const std::stop_token& stop, PlanJournal* journal, SharedWork* shared,
                       OnStop on_stop) {
  constexpr double kIndexShare = 0.1;
  const double refine_share = options.refine == Refine::kNone ? 0 : options.rematch > 0 ? 0.6 : 0.3;
  const double fine_share = options.fine_rotation ? 0.1 * (1 - refine_share) : 0;
  const double placed_share = 1 - refine_share;  // and turned
  Reporter report(progress);
  const Stopwatch start;
  report(0, "reading the wood");
  Result<Problem> problem =
      make_problem(artworks, stock, options, stop, shared != nullptr ? &shared->saliency : nullptr,
                   [&](std::string_view doing) { report(0, std::string(doing)); });
  if (!problem.ok()) return problem.error();
  Result<KeptPatches> staying = keep_pieces(artworks, stock, options, *problem, stop);
  if (!staying.ok()) return staying.error();

  const int threads = threads_meant(options.threads);
  Plan plan = describe(artworks, stock, options);
  plan.warnings = std::move(problem->warnings);
  add_idle_options(options, plan.warnings);
  plan.mosaic = problem->mosaic;
  plan.tilings = std::move(problem->tilings);
  plan.segmentation = std::move(problem->segmentation);
  if (plan.mosaic) note_turning_cells(*plan.mosaic, artworks, plan.warnings);
  if (plan.segmentation) note_merged_areas(*plan.segmentation, artworks, options, plan.warnings);
  plan.morph = problem->morph;
  std::unique_ptr<Matcher> matcher;
  if (shared != nullptr) {
    Result<std::unique_ptr<Matcher>> before = shared->matcher_for(*problem, options, threads, stop);
    if (!before.ok()) return before.error();
    matcher = std::move(*before);
  }
  if (matcher == nullptr) {
    matcher = make_matcher(*problem, options);
    const Result<ShortlistMatcher*> kept = keep_index(*matcher, stock, options);
    if (!kept.ok()) return kept.error();
    report(0, "indexing the wood");  // whose own reports come from whatever the calling thread gets to do of it
    const Status built =
        matcher->build_index(threads, stop, [&](double done) { report(kIndexShare * done, "indexing the wood"); });
    if (!built.ok()) return built.error();
    if (*kept != nullptr && (*kept)->not_kept()) plan.warnings.push_back((*kept)->not_kept()->message);
  }
  plan.seconds.features = start.seconds();

  const Stopwatch match_start;
  const std::size_t count = problem->queue.size() + problem->squares.size();
  // Of what the index leaves, greedy's part of the time.
  const double greedy_share =
      (placed_share - kIndexShare - fine_share) * (options.optimize == Optimize::kGlobal ? 0.2 : 1);
  const auto on_placed = [&](std::size_t placed) {
    report(kIndexShare + greedy_share * static_cast<double>(placed) / static_cast<double>(count),
           fmt::format("placing pieces: {} of {}", placed, count));
  };
  MaterialUse kept_use(problem->limits);  // of pieces that stay
  for (std::size_t i = 0; i < staying->tasks.size(); ++i) {
    const Ring<ArtworkFrame>& outline = staying->tasks[i].match.outline;
    const PatchPlacement& there = *staying->placements[i];
    kept_use.add(problem->limits.of(outline, there.panel, there.panel_from_artwork), area_of(outline));
  }
  MaterialUse use = kept_use;
  LimitSet refused;  // limits that refused wood to a patch
  const auto chosen =
      problem->squares.empty()
          ? place_in_turn(*problem, *matcher, threads, stop, on_placed, journal, &use, &refused)
          : place_squares(*problem, options.adaptive_factor, *matcher, threads, stop, on_placed, journal);
  if (!chosen.ok()) return chosen.error();
  PatchPlacements patches = placements_of(*problem, *matcher, *chosen);
  // Wood that was closed by its limit is there all the same.
  if (!refused.empty())
    if (const Status open = take_anew(*matcher, *problem, patches, threads, stop); !open.ok()) return open.error();
  if (options.optimize == Optimize::kGlobal && !problem->queue.empty()) {
    const double done = kIndexShare + greedy_share;
    Result<GlobalOutcome> global = plan_globally(
        *problem, *matcher, *chosen, options, threads,
        [&](double share, const std::string& text) { report(done + (placed_share - fine_share - done) * share, text); },
        stop, journal, &kept_use, on_stop);
    if (!global.ok()) return global.error();
    patches = std::move(global->patches);
    plan.global = global->report;
    if (global->refused) refused = *global->refused;
  }
  plan.seconds.match = match_start.seconds();
  if (options.fine_rotation) {
    const Stopwatch fine_start;
    report(placed_share - fine_share, "turning pieces finely");
    Result<FineOutcome> fine = turn_finely(
        *problem, *matcher, std::move(patches), threads,
        [&](double share) { report(placed_share - fine_share * (1 - share), "turning pieces finely"); }, stop, journal,
        on_stop);
    if (!fine.ok()) return fine.error();
    if (fine->stopped) plan.warnings.emplace_back("not all pieces are turned finely, because planning was stopped");
    patches = std::move(fine->patches);
    plan.fine = fine->report;
    plan.seconds.refine = fine_start.seconds();
  }
  Refinement refined;
  if (options.refine != Refine::kNone && !problem->queue.empty()) {
    const Stopwatch refine_start;
    report(placed_share, "refining borders");
    Result<Refinement> cut = refine_boundaries(
        *problem, *matcher, std::move(patches), options, threads,
        [&](double share) { report(1 - refine_share * (1 - share), "refining borders"); }, stop, on_stop);
    if (!cut.ok()) return cut.error();
    refined = *std::move(cut);
    if (refined.stopped) plan.warnings.emplace_back("borders are not refined to the end, because planning was stopped");
    patches = std::move(refined.patches);
    plan.refined = std::move(refined.report);
    plan.refined->seconds = refine_start.seconds();
    plan.seconds.refine += plan.refined->seconds;
  }
  Result<std::optional<Shortage>> shortage = shortage_of(*problem, *matcher, patches, options.patch, refused, stop);
  if (!shortage.ok()) {
    if (on_stop == OnStop::kCancel) return shortage.error();
    shortage = missing_wood(*problem, patches);
    plan.warnings.emplace_back("what wood is left is not told, because planning was stopped");
  }
  Status listed;  // whether the matcher knows what the plan takes, and then whether all pieces have their alternatives
  if (options.alternatives > 0 && (plan.global || plan.fine))
    listed = take_anew(*matcher, *problem, patches, threads, stop);
  const std::size_t searched = problem->queue.size();
  std::move(staying->tasks.begin(), staying->tasks.end(), std::back_inserter(problem->queue));
  std::move(staying->placements.begin(), staying->placements.end(), std::back_inserter(patches));
  add_pieces(stock, *problem, patches, plan);
  if (plan.refined)
    plan.layouts = in_reading_order(*problem, refined);
  else if (has_layouts(*problem, options))
    plan.layouts = layouts_of(*problem, options, plan);
  plan.shortage = *std::move(shortage);
  note_material_shares(artworks, stock, *problem, options, patches, refused, plan);
  for (const WorkingArtwork& work : problem->artworks) plan.targets.push_back(work.features);
  note_unfit_pieces(options, threads, plan);
  if (options.alternatives > 0) {
    if (listed.ok())
      listed = add_alternatives(stock, *problem, *matcher, patches, searched, options, threads, stop, plan);
    if (!listed.ok() && on_stop == OnStop::kCancel) return listed.error();
    if (!listed.ok())
      plan.warnings.emplace_back("no alternatives of the pieces are listed, because planning was stopped");
  }
  if (plan.shortage) plan.warnings.insert(plan.warnings.begin(), sentence_of(*plan.shortage, plan.pieces.size()));
  if (shared != nullptr && listed.ok()) shared->keep(std::move(matcher), *problem, options);
  report(1, fmt::format("placed {} of {} pieces", plan.pieces.size() - unfilled(plan), plan.pieces.size()));
  return plan;
}

}  // namespace veneer::planner
