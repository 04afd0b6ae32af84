#include "planner/problem/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <future>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "planner/cancelled.h"
#include "planner/layout/adaptive_grid.h"
#include "planner/matching/kernels.h"
#include "planner/morph/morphed_grid.h"
#include "planner/parallel.h"
#include "planner/pictures/features.h"
#include "planner/problem/free_layout.h"
#include "planner/problem/priority.h"
#include "planner/stopwatch.h"

namespace veneer::planner {
namespace {

// Windows of patches that differ by the rounding of their borders share a class.
WindowClass common_class(const std::vector<const MatchPatch*>& patches) {
  WindowClass out;
  out.width = patches.front()->pixels.width, out.height = patches.front()->pixels.height;
  out.least = std::numeric_limits<std::int64_t>::max();
  out.left = out.top = -1e9, out.right = out.bottom = 1e9;
  for (const MatchPatch* each : patches) {
    const MatchPatch& patch = *each;
    out.width = std::min(out.width, patch.pixels.width), out.height = std::min(out.height, patch.pixels.height);
    out.widest = std::max(out.widest, patch.pixels.width), out.tallest = std::max(out.tallest, patch.pixels.height);
    const std::int64_t area = static_cast<std::int64_t>(patch.pixels.width) * patch.pixels.height;
    out.least = std::min(out.least, area), out.most = std::max(out.most, area);
    out.filled = out.filled && patch.pixels.filled();
    const ScanResolution& resolution = patch.grid.resolution;
    const Box<ArtworkFrame> box = bounds(patch.outline);
    out.left = std::max(out.left, resolution.to_px(box.min.x).count() - patch.pixels.left);
    out.right = std::min(out.right, resolution.to_px(box.max.x).count() - patch.pixels.left);
    out.top = std::max(out.top, resolution.to_px(patch.grid.height - box.max.y).count() - patch.pixels.top);
    out.bottom = std::min(out.bottom, resolution.to_px(patch.grid.height - box.min.y).count() - patch.pixels.top);
  }
  out.x = choose_blocks(out.width), out.y = choose_blocks(out.height);
  return out;
}

bool fits_somewhere(const Ring<ArtworkFrame>& outline, const Problem& problem, const std::vector<Radians>& all_turns) {
  const Box<ArtworkFrame> box = bounds(outline);
  return std::any_of(problem.panels.begin(), problem.panels.end(), [&](const MatchPanel& panel) {
    const Millimetres margin = panel.wood.border() * 2;
    return fits(box.width() + margin, box.height() + margin, panel.features.width(), panel.features.height(),
                all_turns);
  });
}

std::size_t class_index(std::vector<WindowClass>& classes, const WindowClass& wanted) {
  for (std::size_t i = 0; i < classes.size(); ++i) {
    WindowClass& it = classes[i];
    if (it.width != wanted.width || it.height != wanted.height) continue;
    it.widest = std::max(it.widest, wanted.widest), it.tallest = std::max(it.tallest, wanted.tallest);
    it.least = std::min(it.least, wanted.least), it.most = std::max(it.most, wanted.most);
    it.filled = it.filled && wanted.filled;
    it.left = std::max(it.left, wanted.left), it.right = std::min(it.right, wanted.right);
    it.top = std::max(it.top, wanted.top), it.bottom = std::min(it.bottom, wanted.bottom);
    return i;
  }
  classes.push_back(wanted);
  return classes.size() - 1;
}

// The layout of one artwork as tasks; squares that are larger than every panel are left out in favour of their parts.
class Squares {
 public:
  Squares(const Artwork& artwork, std::size_t index, const std::vector<Radians>& all_turns, Problem& problem)
      : artwork_(artwork), index_(index), turns_(all_turns), problem_(problem), work_(problem.artworks[index]) {}

  std::vector<TaskTree> of(const std::vector<PatchTree>& layout) {
    std::vector<TaskTree> out;
    for (const PatchTree& tree : layout) add(tree, out);
    return out;
  }

  // Gives each size its class of windows; kInvalidArgument when a patch has too few pixels.
  Status classify(std::vector<TaskTree>& squares, const PlanOptions& options) {
    std::map<Size, std::vector<TaskTree*>> by_size;
    for (TaskTree& square : squares) collect(square, by_size);
    const std::vector<double> important = importances(artwork_, work_.patches);
    for (auto& [size, trees] : by_size) {
      std::vector<const MatchPatch*> patches;
      for (const TaskTree* tree : trees) patches.push_back(&tree->task.match);
      const WindowClass windows = common_class(patches);
      if (std::min(windows.width, windows.height) < kSmallestPatch)
        return unusable(
            fmt::format("a patch of \"{}\" has only {} x {} pixels at {} dpi: choose larger patches or a finer "
                        "working resolution",
                        artwork_.name, windows.width, windows.height, options.dpi));
      const std::size_t index = class_index(problem_.classes, windows);
      for (TaskTree* tree : trees) {
        tree->task.match.window_class = index;
        tree->task.importance = important[tree->task.patch];
      }
    }
    return Ok();
  }

 private:
  void add(const PatchTree& tree, std::vector<TaskTree>& out) {
    if (!tree.parts.empty() && !fits_somewhere(tree.patch.outline, problem_, turns_)) {
      for (const PatchTree& part : tree.parts) add(part, out);
      return;
    }
    TaskTree& square = out.emplace_back();
    square.task.artwork = index_;
    square.task.patch = work_.patches.size();
    square.task.match = {patch_pixels(tree.patch.outline, work_.grid, work_.features.cols, work_.features.rows),
                         tree.patch.outline, &work_.features, work_.grid, 0};
    work_.patches.push_back(tree.patch);
    std::vector<TaskTree> parts;
    for (const PatchTree& part : tree.parts) add(part, parts);
    square.parts = std::move(parts);
  }

  // Patches of one size share an index: squares of as many cells; of other shapes those whose windows are roughly
  // alike, so that a layout with as many windows as patches has few indexes.
  using Size = std::tuple<int, int, int>;
  static Size size_of(const Patch& patch, const PatchPixels& pixels) {
    if (patch.number == Patch::kInGrid && patch.outline.size() == 4 && pixels.filled()) return {patch.cells, 0, 0};
    constexpr double kAlike = 2.2;
    const auto step = [&](int pixels_wide) {
      return 1 + static_cast<int>(std::log(std::max(1, pixels_wide)) / std::log(kAlike));
    };
    return {0, step(pixels.width), step(pixels.height)};
  }

  void collect(TaskTree& tree, std::map<Size, std::vector<TaskTree*>>& by_size) {
    by_size[size_of(work_.patches[tree.task.patch], tree.task.match.pixels)].push_back(&tree);
    for (TaskTree& part : tree.parts) collect(part, by_size);
  }

  const Artwork& artwork_;
  std::size_t index_;
  const std::vector<Radians>& turns_;
  Problem& problem_;
  WorkingArtwork& work_;
};

// What becomes of the layout when the pieces of an earlier plan say how far squares are cut: single patches. None when
// that plan has no piece of this artwork.
Result<std::vector<PatchTree>> in_kept_sizes(const std::vector<PatchTree>& layout, const Artwork& artwork,
                                             const std::vector<KeptPiece>& kept) {
  std::map<std::pair<std::string, int>, const KeptPiece*> wanted;
  for (const KeptPiece& piece : kept) wanted.emplace(std::pair(piece.mark, piece.cells), &piece);
  std::vector<PatchTree> out;
  std::string missing;
  std::vector<const PatchTree*> open;
  for (auto tree = layout.rbegin(); tree != layout.rend(); ++tree) open.push_back(&*tree);
  while (!open.empty()) {
    const PatchTree& tree = *open.back();
    open.pop_back();
    const std::string mark = mark_of(artwork.letter, tree.patch);
    if (const auto there = wanted.find({mark, tree.patch.cells}); there != wanted.end()) {
      out.push_back({tree.patch, {}});
      if (!there->second->outline.empty()) out.back().patch.outline = there->second->outline;
    } else if (tree.parts.empty()) {
      if (missing.empty()) missing = mark;
    } else {
      for (auto part = tree.parts.rbegin(); part != tree.parts.rend(); ++part) open.push_back(&*part);
    }
  }
  if (!out.empty() && !missing.empty())
    return unusable(
        fmt::format("the plan that is kept has no piece {}: plan the same pictures in the same patches", missing));
  return out;
}

struct Layout {
  std::vector<TaskTree> squares;
  bool fixed = false;  // patches are of the sizes that they have
};

// Ninths of a picture, in words.
std::string_view ninth_of(const PlanePoint& share) {
  constexpr std::array<std::string_view, 9> kNinths = {"upper left", "top",    "upper right", "left", "middle", "right",
                                                       "lower left", "bottom", "lower right"};
  const auto third = [](double at) { return static_cast<std::size_t>(std::clamp(static_cast<int>(at * 3), 0, 2)); };
  return kNinths[3 * third(share.y) + third(share.x)];
}

void note_turning(const std::vector<PlanePoint>& turning, std::size_t artwork,
                  std::vector<MosaicReport::Turning>& all) {
  std::vector<MosaicReport::Turning> own;
  for (const PlanePoint& it : turning) {
    const std::string_view where = ninth_of(it);
    auto known = std::ranges::find(own, where, &MosaicReport::Turning::where);
    if (known == own.end()) known = own.insert(own.end(), {artwork, std::string(where), 0});
    ++known->cells;
  }
  std::ranges::stable_sort(own, std::greater(), &MosaicReport::Turning::cells);
  all.insert(all.end(), own.begin(), own.end());
}

// Adds up what came of several artworks.
void note_figures(const MosaicFigures& figures, double seconds, std::size_t artwork,
                  std::optional<MosaicReport>& report) {
  MosaicReport& all = report ? *report : report.emplace();
  note_turning(figures.turning, artwork, all.turning);
  all.tiles += static_cast<std::size_t>(figures.tiles), all.seconds += seconds;
  all.iterations = std::max(all.iterations, figures.iterations);
  all.mean_move_px = std::max(all.mean_move_px, figures.mean_move_px);
  all.deviation_deg = std::max(all.deviation_deg, figures.deviation_deg);
  all.cell_deviation_deg = std::max(all.cell_deviation_deg, figures.cell_deviation_deg);
  all.straddling = std::max(all.straddling, figures.straddling);
}

void note_figures(const TileFigures& figures, MosaicReport& all) {
  TilesReport& worst = all.with_joints ? *all.with_joints : all.with_joints.emplace();
  worst.coverage = std::min(worst.coverage, figures.coverage);
  worst.overlap = std::max(worst.overlap, figures.overlap);
  worst.deviation_deg = std::max(worst.deviation_deg, figures.deviation_deg);
  worst.straddling = std::max(worst.straddling, figures.straddling);
}

void note_fates(const RegionFates& fates, std::size_t artwork, std::optional<SegmentationReport>& report) {
  SegmentationReport& all = report ? *report : report.emplace();
  all.areas += fates.regions;
  for (const RegionFates::Merged& it : fates.merged) all.merged.push_back({artwork, it.at, it.area});
  std::stable_sort(all.merged.begin(), all.merged.end(), [](const auto& a, const auto& b) { return a.area > b.area; });
}

void note_figures(const MorphFigures& figures, double seconds, std::optional<MorphReport>& report) {
  if (!report) report = MorphReport{{}, {}, figures.edges_before, figures.edges_after, 0, 0, 0};
  if (figures.edges_after < report->edges_after)
    report->edges_before = figures.edges_before, report->edges_after = figures.edges_after;
  report->mean_move = std::max(report->mean_move, figures.mean_move);
  report->most_move = std::max(report->most_move, figures.most_move);
  report->relaxed += figures.relaxed, report->split += figures.split, report->seconds += seconds;
}

Result<MorphedGrid> morphed(const Artwork& artwork, const PlanOptions& options, const WorkingArtwork& work,
                            Problem& problem, const std::stop_token& stop) {
  const Stopwatch watch;
  const MorphOptions wanted = morph_options(artwork, options);
  Result<MorphedGrid> made = morphed_grid(artwork.picture, work.tones, artwork.width, work.grid, wanted, stop);
  if (made.ok())
    note_figures(made->figures, watch.seconds(), problem.morph);
  else if (made.error().code == ErrorCode::kInvalidArgument)
    return unusable(fmt::format("\"{}\": {}", artwork.name, made.error().message));
  return made;
}

Result<std::vector<PatchTree>> morphed_cells(const Artwork& artwork, const PlanOptions& options, WorkingArtwork& work,
                                             Problem& problem, const std::stop_token& stop) {
  Result<MorphedGrid> made = morphed(artwork, options, work, problem, stop);
  if (!made.ok()) return made.error();
  std::vector<PatchTree> out;
  for (Patch& cell : grid_layout(artwork.width, artwork.height, options.patch)) {
    cell.outline = outline_of(made->partition, out.size());
    out.push_back({std::move(cell), {}});
  }
  work.layout = std::move(made->partition), work.lines = std::move(made->lines);
  return out;
}

// The layout without rows that an earlier plan has of the artwork; null: none.
const KeptLayout* kept_free(const Artwork& artwork, const PlanOptions& options) {
  const auto kept = std::find_if(options.kept_layouts.begin(), options.kept_layouts.end(),
                                 [&](const KeptLayout& it) { return it.letter == artwork.letter && it.is_free; });
  return kept != options.kept_layouts.end() ? &*kept : nullptr;
}

// The layout without rows that an earlier plan has of the artwork, or that the options ask for; none: it is a grid.
Result<std::optional<Partition>> layout_without_rows(const Artwork& artwork, std::size_t index,
                                                     const PlanOptions& options, SaliencyMaps& saliency,
                                                     Problem& problem, const std::stop_token& stop) {
  if (const KeptLayout* kept = kept_free(artwork, options)) return std::optional(kept->layout);
  if (options.layout == LayoutKind::kGrid) return std::optional<Partition>();
  if (options.layout == LayoutKind::kMorph) {
    Result<MorphedGrid> made = morphed(artwork, options, problem.artworks[index], problem, stop);
    if (!made.ok()) return made.error();
    return std::optional(std::move(made->partition));
  }
  const Stopwatch watch;
  Result<FreeLayout> made = free_layout(artwork, options, saliency, stop);
  if (!made.ok()) return made.error();
  if (made->mosaic) note_figures(*made->mosaic, watch.seconds(), index, problem.mosaic);
  if (made->tile_figures) {
    note_figures(*made->tile_figures, *problem.mosaic);
    problem.tilings.push_back({index, std::move(made->tiles)});
  }
  if (made->drawn) note_fates(*made->drawn, index, problem.segmentation);
  return std::optional(std::move(made->partition));
}

// kInvalidArgument: a patch is larger than every panel. A grid's are looked at by check_input().
Result<std::vector<PatchTree>> faces_of(const Partition& layout, const Artwork& artwork,
                                        const std::vector<Radians>& all_turns, const Problem& problem) {
  std::vector<PatchTree> out;
  for (std::size_t f = 0; f < layout.faces.size(); ++f) {
    const Patch patch{0, 0, outline_of(layout, f), 1, static_cast<int>(f)};
    const Box<ArtworkFrame> box = bounds(patch.outline);
    if (!fits_somewhere(patch.outline, problem, all_turns))
      return unusable(fmt::format(
          "piece {} of \"{}\" ({:.1f} x {:.1f} mm) is larger than every panel: choose smaller patches or add a panel",
          mark_of(artwork.letter, patch), artwork.name, box.width().count(), box.height().count()));
    out.push_back({patch, {}});
  }
  return out;
}

Result<Layout> squares_of(const Artwork& artwork, std::size_t index, const PlanOptions& options,
                          const std::vector<Radians>& all_turns, SaliencyMaps& saliency, Problem& problem,
                          const std::stop_token& stop) {
  auto layout = adaptive_layout(artwork.width, artwork.height, options.patch, options.adaptive_levels);
  Result<std::vector<PatchTree>> fixed = in_kept_sizes(layout, artwork, options.kept);
  if (!fixed.ok()) return fixed.error();
  bool is_fixed = !fixed->empty();
  if (is_fixed) {
    layout = *fixed;
  } else if (options.layout == LayoutKind::kMorph && !options.triangles && kept_free(artwork, options) == nullptr) {
    Result<std::vector<PatchTree>> cells = morphed_cells(artwork, options, problem.artworks[index], problem, stop);
    if (!cells.ok()) return cells.error();
    layout = std::move(*cells), is_fixed = true;
  } else {
    Result<std::optional<Partition>> free = layout_without_rows(artwork, index, options, saliency, problem, stop);
    if (!free.ok()) return free.error();
    if (*free) {
      Result<std::vector<PatchTree>> faces = faces_of(**free, artwork, all_turns, problem);
      if (!faces.ok()) return faces.error();
      layout = std::move(*faces), is_fixed = true;
      problem.artworks[index].layout = std::move(**free);
    }
  }
  Squares builder(artwork, index, all_turns, problem);
  std::vector<TaskTree> squares = builder.of(layout);
  if (Status status = builder.classify(squares, options); !status.ok()) return status.error();
  return Layout{std::move(squares), is_fixed};
}

// When a square chooses: the smaller the earlier.
struct Turn {
  bool waits;           // until the most urgent squares of all artworks have chosen
  std::size_t artwork;  // of those that wait; 0 for the others, which choose together
  double calm;          // minus urgency
  friend auto operator<=>(const Turn&, const Turn&) = default;
};

}  // namespace

bool fits(Millimetres width, Millimetres height, Millimetres into_width, Millimetres into_height,
          const std::vector<Radians>& turns) {
  return std::any_of(turns.begin(), turns.end(), [&](Radians turn) {
    const double c = std::abs(std::cos(turn.count())), s = std::abs(std::sin(turn.count()));
    return width * c + height * s <= into_width && width * s + height * c <= into_height;
  });
}

std::vector<Radians> turns(int rotations) {
  std::vector<Radians> out;
  out.reserve(static_cast<std::size_t>(rotations));
  for (int k = 0; k < rotations; ++k) out.push_back(degrees(360.0 * k / rotations));
  return out;
}

Problem::Problem() = default;
Problem::Problem(Problem&&) noexcept = default;
Problem& Problem::operator=(Problem&&) noexcept = default;
Problem::~Problem() = default;

Result<Problem> make_problem(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                             const PlanOptions& options, const std::stop_token& stop, SaliencyMaps* maps,
                             const std::function<void(std::string_view)>& doing) {
  if (Status status = check_input(artworks, stock, options); !status.ok()) return status.error();
  SaliencyMaps fresh;
  SaliencyMaps& saliency = maps != nullptr ? *maps : fresh;
  // Saliency looks at the targets alone, so it need not wait for the wood.
  std::future<void> salient;
  if (options.priority == Priority::kSaliency)
    salient = std::async(threads_meant(options.threads) > 1 ? std::launch::async : std::launch::deferred, [&] {
      for (std::size_t a = 0; a < artworks.size() && !stop.stop_requested(); ++a) saliency.of(artworks[a].picture);
    });
  Result<WorkingPictures> pictures = working_pictures(artworks, stock, options, stop);
  if (salient.valid()) salient.get();
  if (!pictures.ok()) return pictures.error();
  Problem problem;
  problem.panels = std::move(pictures->panels);
  problem.artworks = std::move(pictures->artworks);
  problem.warnings = std::move(pictures->warnings);

  const auto all_turns = turns(options.rotations);
  std::vector<TaskTree> squares;
  std::vector<Turn> queue;
  std::vector<bool> of_one_size;  // squares that may be cut otherwise are not
  for (std::size_t a = 0; a < artworks.size(); ++a) {
    if (stop.stop_requested()) return cancelled();
    if (doing && options.layout != LayoutKind::kGrid) doing(fmt::format("laying out \"{}\"", artworks[a].name));
    Result<Layout> layout = squares_of(artworks[a], a, options, all_turns, saliency, problem, stop);
    if (!layout.ok()) return layout.error();
    std::vector<TaskTree>& own = layout->squares;
    std::vector<Patch> patches;
    patches.reserve(own.size());
    for (const TaskTree& square : own) patches.push_back(problem.artworks[a].patches[square.task.patch]);
    const auto urgent = urgencies(artworks[a], patches, options.priority, saliency);
    const double share = options.interleave ? 1 : options.reserve;
    const auto early = static_cast<std::size_t>(std::ceil(share * static_cast<double>(own.size())));
    std::size_t rank = 0;
    for (const std::size_t i : by_urgency(urgent)) {
      const bool waits = rank++ >= early;
      queue.push_back({waits, waits ? a : 0, -urgent[i]});
      squares.push_back(std::move(own[i]));
      of_one_size.push_back(options.adaptive_levels == 0 || layout->fixed);
    }
  }
  std::vector<std::size_t> order(squares.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return queue[a] < queue[b]; });
  for (const std::size_t i : order) {
    if (of_one_size[i])
      problem.queue.push_back(std::move(squares[i].task));
    else
      problem.squares.push_back(std::move(squares[i]));
  }
  auto marks = PieceMarks::make(options.marks, artworks, problem.artworks);
  if (!marks.ok()) return marks.error();
  problem.marks = std::move(*marks);
  problem.limits = MaterialLimits(artworks, stock, options.material_limits);
  problem.entries_per_unit = (kernels::kLargestEntry - 1) / largest_response(options);
  return problem;
}

}  // namespace veneer::planner
