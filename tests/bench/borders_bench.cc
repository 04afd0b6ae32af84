// What cutting the borders of 500 pieces along the picture takes, beside its goal: wood is chosen before, and not
// counted. Processor time of all threads, which other work on the machine hardly changes, and what the assembled
// picture costs, so that no speed is bought with it.
//
// The picture comes from the developer's data set beside the sources (VENEER_DATA names another folder); without it
// nothing is measured.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <ctime>
#include <filesystem>
#include <string>

#include "planner/boundaries/refinement.h"
#include "planner/global/global_plan.h"
#include "planner/greedy/greedy.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/pictures/features.h"
#include "planner/pictures/pictures.h"
#include "planner/problem/problem.h"
#include "tests/bench/data_folder.h"
#include "tests/bench/goals.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

constexpr double kDpi = 300;
constexpr double kPatchPixels = 48;
constexpr int kPatches = 23;  // a side: 529 in all

const bool kWanted = bench::Goals::all().add({{"BM_borders_of_500_pieces", "processor_s", 2, "s"}});

template <class T>
T sure(Result<T> result) {
  if (result.ok()) return *std::move(result);
  fmt::print(stderr, "borders_bench: {}\n", result.error().message);
  std::exit(1);
}

void BM_borders_of_500_pieces(benchmark::State& state) {
  const fs::path data = bench::data_folder();
  Result<cv::Mat> picture = load_picture(data / "targets" / "astronaut.png");
  Result<cv::Mat> scan = load_picture(data / "wood" / "panel_large.jpg");
  Result<cv::Mat> mask = load_mask(data / "wood" / "panel_large_mask.png");
  if (!picture.ok() || !scan.ok() || !mask.ok()) return state.SkipWithError("the developer's pictures are not there");
  StockPanel panel;
  panel.id = {"large"};
  panel.picture.pixels = *scan, panel.free.pixels = *mask;
  panel.picture.resolution = panel.free.resolution = ScanResolution::from_dpi(kDpi);
  PlanOptions options;
  options.patch = panel.picture.resolution.to_mm(Pixels(kPatchPixels)), options.dpi = kDpi, options.threads = 1;
  options.refine = Refine::kDp;
  const ArtworkSize size = artwork_size(*picture, options.patch * kPatches);
  const Artwork artwork{"astronaut", "A", *picture, size.width, size.height};
  for (auto _ : state) {
    Problem problem = sure(make_problem({&artwork, 1}, {&panel, 1}, options));
    ShortlistMatcher matcher(problem.panels, turns(options.rotations), problem.classes, largest_response(options));
    if (!matcher.build_index(options.threads, {}).ok()) return state.SkipWithError("the wood was not indexed");
    const auto chosen = sure(place_in_turn(problem, matcher, options.threads, {}, [](std::size_t) {}));
    const std::size_t pieces = problem.queue.size();
    PatchPlacements placements = placements_of(problem, matcher, chosen);
    const std::clock_t before = std::clock();
    const Refinement refined =
        sure(refine_boundaries(problem, matcher, std::move(placements), options, options.threads, [](double) {}, {}));
    state.counters["processor_s"] = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    state.counters["pieces"] = static_cast<double>(pieces);
    state.counters["cost_straight"] = refined.report.cost_before;
    state.counters["cost"] = refined.report.cost;
  }
}
BENCHMARK(BM_borders_of_500_pieces)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace veneer::planner
