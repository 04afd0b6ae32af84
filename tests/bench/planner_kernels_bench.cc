// The searches' inner loops against what the machine can move and multiply: bytes read and products added up a second,
// from the nearest cache and from memory.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

#include "planner/matching/kernels.h"
#include "planner/matching/score_kernels.h"
#include "planner/matching/window_samples.h"

namespace veneer::planner::kernels {
namespace {

constexpr std::size_t kNear = 16UL << 10U, kFar = 256UL << 20U;  // bytes

std::vector<std::int16_t> entries(std::size_t count) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> entry(0, kLargestEntry);
  std::vector<std::int16_t> out(count);
  for (std::size_t i = 0; i < std::min(count, kNear); ++i) out[i] = static_cast<std::int16_t>(entry(random));
  for (std::size_t i = kNear; i < count; i += kNear)
    std::copy_n(out.begin(), std::min(kNear, count - i), out.begin() + static_cast<std::ptrdiff_t>(i));
  return out;
}

void set_bytes(benchmark::State& state, double bytes) {
  state.counters["bytes_per_second"] =
      benchmark::Counter(bytes * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

// The yardstick: a sum over the same bytes, which the compiler turns into plain loads and additions.
void read_bytes(benchmark::State& state, std::size_t bytes) {
  const std::vector<std::uint64_t> data(bytes / sizeof(std::uint64_t), 3);
  for (auto _ : state) {
    std::uint64_t lanes[32] = {};
    for (std::size_t i = 0; i < data.size(); i += 32)
      for (std::size_t k = 0; k < 32; ++k) lanes[k] += data[i + k];
    benchmark::DoNotOptimize(lanes);
  }
  set_bytes(state, static_cast<double>(bytes));
}

// A window of 48 x 48 pixels and two channels, over and over, or at places that no cache holds.
void window(benchmark::State& state, const Versions& version, std::size_t bytes) {
  constexpr std::size_t kLength = 96, kStride = 3000;
  constexpr int kRows = 48;
  const auto data = entries(std::max(bytes / 2, kStride * kRows + kLength));
  const std::size_t places = std::max<std::size_t>(1, data.size() / (kStride * kRows));
  const auto target = entries(kLength * kRows);
  const std::vector<std::uint32_t> mask(kLength / kRowStep * kRows, 0xffffffffU);
  std::vector<int> rows(kRows);
  std::iota(rows.begin(), rows.end(), 0);
  // Nearby windows lie densely, so that they stay in the cache.
  std::vector<std::ptrdiff_t> base;
  for (int r = 0; r < kRows; ++r) base.push_back(static_cast<std::ptrdiff_t>(places == 1 ? kLength : kStride) * r);
  const WindowRows query{target.data(), mask.data(), kLength, rows.data(), kRows};
  std::size_t at = 0;
  for (auto _ : state) {
    at = (at + 7919) % places;
    benchmark::DoNotOptimize(
        version.window_ssd(query, data.data(), base.data(), static_cast<std::ptrdiff_t>(at * kStride * kRows), ~0ULL));
  }
  set_bytes(state, 2.0 * kLength * kRows);
}

// Sums for the 4 x 4 places of one cell; counts the bytes of the panel, each once.
void sums(benchmark::State& state, const Versions& version) {
  constexpr std::size_t kLength = 128;
  constexpr int kGroups = 6, kShifts = 4;
  const auto data = entries(kLength * (kGroups * kTallestSum + kShifts));
  std::vector<std::ptrdiff_t> base;
  for (int r = 0; r < kGroups * kTallestSum + kShifts; ++r) base.push_back(static_cast<std::ptrdiff_t>(kLength) * r);
  std::vector<std::int16_t> out(kLength * kGroups * kShifts);
  for (auto _ : state) {
    version.row_sums(data.data(), base.data(), 0, kTallestSum, kGroups, kShifts, kLength, out.data());
    benchmark::ClobberMemory();
  }
  set_bytes(state, 2.0 * kLength * (kGroups * kTallestSum + kShifts - 1));
}

// All 64 taps of 32 cells, side by side in memory as an index row has them.
void bounds(benchmark::State& state, const Versions& version, std::size_t bytes) {
  constexpr std::size_t kTaps = 64;
  const std::size_t cells = std::max<std::size_t>(kCellsAtOnce * 2, bytes / (4 * kTaps));
  std::vector<std::uint16_t> low(cells * kTaps, 100), high(cells * kTaps, 120);
  std::vector<TapRow> taps;
  for (std::size_t t = 0; t < kTaps; ++t) taps.push_back({low.data() + t * cells, high.data() + t * cells, 130, 131});
  std::uint16_t out[kCellsAtOnce];
  std::size_t at = 0;
  for (auto _ : state) {
    at = at + 2 * kCellsAtOnce <= cells ? at + kCellsAtOnce : 0;
    benchmark::DoNotOptimize(version.cell_bounds(taps.data(), kTaps, static_cast<std::ptrdiff_t>(at), 5, 65534, out));
  }
  set_bytes(state, 4.0 * kTaps * kCellsAtOnce);
}

// A window of 6 x 6 blocks and two channels against cells side by side, row after row of a map.
void scores(benchmark::State& state, const ScoreVersion& version, std::size_t bytes) {
  constexpr int kSide = 6;
  constexpr std::size_t kGroups = 32, kRowEntries = 2 * (kGroups * kGroup + 64);
  const auto rows = static_cast<std::ptrdiff_t>(std::max<std::size_t>(2 * kSide, bytes / (2 * kRowEntries)));
  const auto data = entries(static_cast<std::size_t>(rows) * kRowEntries);
  const std::vector<std::int32_t> offsets(kGroups * kGroup, 1 << 20), taps(kSide * kSide, 0x00100020);
  std::vector<std::uint32_t> groups;
  for (std::size_t g = 0; g < kGroups; ++g) groups.push_back(static_cast<std::uint32_t>(g * kGroup));
  std::vector<std::int32_t> out(kGroups * kGroup);
  std::vector<std::uint16_t> below(kGroups);
  std::ptrdiff_t row = 0;
  for (auto _ : state) {
    row = row + 2 * kSide < rows ? row + 1 : 0;
    const std::int16_t* blocks[kSide];
    for (int k = 0; k < kSide; ++k) blocks[k] = data.data() + (row + 2 * k) * static_cast<std::ptrdiff_t>(kRowEntries);
    version.run({taps.data(), 1, kSide, kSide}, {blocks, offsets.data()}, groups.data(), kGroups, 0, out.data(),
                below.data());
    benchmark::ClobberMemory();
  }
  // Each row of the map is read once from far; each cell multiplies two channels of every block.
  set_bytes(state, 2.0 * kRowEntries);
  state.counters["products_per_second"] = benchmark::Counter(
      2.0 * kSide * kSide * kGroups * kGroup * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

// Windows of 48 x 48 pixels and two channels, turned by 24 degrees.
void samples(benchmark::State& state, std::size_t bytes) {
  constexpr int kSide = 48;
  const int side = std::max(4 * kSide, static_cast<int>(std::sqrt(static_cast<double>(bytes) / 4)));
  const auto data = entries(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 2);
  const cv::Mat map(side, side, CV_16SC2, const_cast<std::int16_t*>(data.data()));
  const Lattice lattice(side, side, degrees(24));
  std::vector<std::int16_t> out(2 * kSide * kSide + kRowStep);
  std::uint32_t random = 1;
  const auto next = [&] {
    random = random * 1664525U + 1013904223U;
    return lattice.width() / 2 + static_cast<int>((random >> 8U) % static_cast<unsigned>(side / 2)) - side / 4;
  };
  for (auto _ : state) {
    const int x = next(), y = next();
    sample(map, lattice, {static_cast<double>(x), static_cast<double>(y), 1, 1, kSide, kSide}, 2 * kSide, out.data());
    benchmark::ClobberMemory();
  }
  state.counters["samples_per_second"] = benchmark::Counter(
      static_cast<double>(kSide) * kSide * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

const int kRegistered = [] {
  const auto add = [](const std::string& name, auto run) {
    benchmark::RegisterBenchmark(("planner_kernels/" + name).c_str(), run);
  };
  add("read/near", [](benchmark::State& state) { read_bytes(state, kNear); });
  add("read/far", [](benchmark::State& state) { read_bytes(state, kFar); });
  for (const Versions& version : versions()) {
    const std::string name = version.name;
    add("window/near/" + name, [=](benchmark::State& state) { window(state, version, kNear); });
    add("window/far/" + name, [=](benchmark::State& state) { window(state, version, kFar); });
    add("row_sums/near/" + name, [=](benchmark::State& state) { sums(state, version); });
    add("cell_bounds/near/" + name, [=](benchmark::State& state) { bounds(state, version, kNear); });
    add("cell_bounds/far/" + name, [=](benchmark::State& state) { bounds(state, version, kFar); });
  }
  for (const ScoreVersion& version : score_versions()) {
    const std::string name = version.name;
    add("scores/near/" + name, [=](benchmark::State& state) { scores(state, version, 0); });
    add("scores/far/" + name, [=](benchmark::State& state) { scores(state, version, kFar); });
  }
  add("samples/near", [](benchmark::State& state) { samples(state, 0); });
  add("samples/far", [](benchmark::State& state) { samples(state, kFar / 4); });
  return 0;
}();

}  // namespace
}  // namespace veneer::planner::kernels
