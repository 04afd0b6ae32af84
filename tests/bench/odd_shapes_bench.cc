// What matching odd shapes costs beside squares: the cells of a mosaic against a grid of squares of the same area, on
// the same wood, one thread.
//
// Both are planned greedily in turns, several times, so that a machine that is slower for a while is so for both;
// figures are of processor time in user mode: piece_ms and square_ms with the index, and their ratio, for which 2 is
// wanted. The cells' windows are of unlike sizes and belong to several classes.
//
// It needs the developer's data set beside the sources (VENEER_DATA names another folder).
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <filesystem>
#include <optional>
#include <string>

#include "planner/matching/shortlist_matcher.h"
#include "planner/pictures/features.h"
#include "planner/pictures/pictures.h"
#include "planner/problem/problem.h"
#include "tests/bench/data_folder.h"
#include "tests/bench/goals.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

constexpr int kRounds = 3;

double user_seconds() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

struct Scene {
  Artwork artwork;
  StockPanel panel;
};

std::optional<Scene> load() {
  const fs::path data = bench::data_folder();
  const auto target = load_picture(data / "targets" / "astronaut_head.png");
  const auto picture = load_picture(data / "wood" / "panel_small.jpg");
  const auto mask = load_mask(data / "wood" / "panel_small_mask.png");
  if (!target.ok() || !picture.ok() || !mask.ok()) return std::nullopt;
  Scene scene;
  const ArtworkSize size = artwork_size(*target, Millimetres(56.9));
  scene.artwork.name = "target", scene.artwork.letter = "A", scene.artwork.picture = *target;
  scene.artwork.width = size.width, scene.artwork.height = size.height;
  scene.panel.id = {"panel"};
  scene.panel.picture.pixels = *picture, scene.panel.free.pixels = *mask;
  scene.panel.picture.resolution = scene.panel.free.resolution = ScanResolution::from_dpi(300);
  return scene;
}

// What wood is found for, and what that took.
struct Matched {
  double pieces = 0, index_s = 0, pieces_s = 0, cost = 0, pixels = 0;
  double piece_ms() const { return 1e3 * (index_s + pieces_s) / pieces; }
};

void match(const Problem& problem, const PlanOptions& options, Matched& sum) {
  const double start = user_seconds();
  ShortlistMatcher matcher(problem.panels, turns(options.rotations), problem.classes, largest_response(options));
  if (!matcher.build_index(1, {}).ok()) std::abort();
  const double indexed = user_seconds();
  for (const Problem::Task& task : problem.queue) {
    const auto found = *matcher.best(task.match, {});
    if (!found) continue;
    sum.pieces += 1, sum.cost += found->cost, sum.pixels += static_cast<double>(task.match.pixels.count);
    matcher.take(task.match, *found);
  }
  sum.index_s += indexed - start, sum.pieces_s += user_seconds() - indexed;
}

void odd_shapes(benchmark::State& state) {
  const std::optional<Scene> scene = load();
  if (!scene) {
    state.SkipWithError("the data set is not there: VENEER_DATA names its folder");
    return;
  }
  PlanOptions squares;
  squares.patch = Millimetres(4.064), squares.dpi = 300, squares.threads = 1;
  PlanOptions cells = squares;
  cells.layout = LayoutKind::kMosaic;
  const auto grid = make_problem(std::span(&scene->artwork, 1), std::span(&scene->panel, 1), squares);
  const auto mosaic = make_problem(std::span(&scene->artwork, 1), std::span(&scene->panel, 1), cells);
  if (!grid.ok() || !mosaic.ok()) {
    state.SkipWithError((grid.ok() ? mosaic : grid).error().message.c_str());
    return;
  }
  for ([[maybe_unused]] const auto& once : state) {
    Matched of_squares, of_cells;
    for (int round = 0; round < kRounds; ++round) match(*grid, squares, of_squares), match(*mosaic, cells, of_cells);
    state.counters["classes"] = static_cast<double>(mosaic->classes.size());
    state.counters["square_ms"] = of_squares.piece_ms();
    state.counters["piece_ms"] = of_cells.piece_ms();
    state.counters["ratio"] = of_cells.piece_ms() / of_squares.piece_ms();
    // The same without the index.
    state.counters["ratio_choosing"] = of_cells.pieces_s / of_cells.pieces / (of_squares.pieces_s / of_squares.pieces);
    state.counters["cost_per_pixel"] = of_cells.cost / of_cells.pixels;
  }
}
BENCHMARK(odd_shapes)->Name("odd_shapes/mosaic")->Iterations(1)->Unit(benchmark::kSecond);

const bool kGoals = bench::Goals::all().add({{"odd_shapes/mosaic", "ratio", 2, "x"}});

}  // namespace
}  // namespace veneer::planner
