#include <benchmark/benchmark.h>

#include <cstdlib>

#include "tests/planner/cutting/scattered_pieces.h"

namespace veneer::planner {
namespace {

// The whole toolpath of a panel like the demo's: 300 pieces of 14 mm wherever their wood was found. Counters: dark
// travel, and pieces that had to follow a hot neighbour.
void toolpath_300_pieces(benchmark::State& state, bool marks, double cool_mm) {
  const auto pieces = test::scattered_pieces(300, 14, marks);
  ToolpathOptions options;
  options.cool_distance = Millimetres(cool_mm);
  for (auto _ : state) {
    const auto path = make_toolpath(pieces, options);
    if (!path.ok()) std::abort();
    state.counters["travel_mm"] = path->travel.count();
    state.counters["hot_pairs"] = static_cast<double>(path->hot_pairs);
  }
}

BENCHMARK_CAPTURE(toolpath_300_pieces, plain, false, 0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(toolpath_300_pieces, plain_cooled, false, 2)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(toolpath_300_pieces, marked, true, 0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(toolpath_300_pieces, marked_cooled, true, 2)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace veneer::planner
