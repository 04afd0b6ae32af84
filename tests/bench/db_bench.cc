#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdlib>

#include "db/job_store.h"
#include "db/panels.h"
#include "tests/support/temp_directory.h"

namespace veneer::db {
namespace {

const std::string kNow = "2026-05-01T07:30:00.000Z";
const PanelId kPanel{"P-0001"};

Database panel_database(const testing::TempDirectory& directory) {
  auto database = Database::open(directory / "veneerd.db");
  if (!database.ok()) std::abort();
  PanelRecord panel;
  panel.id = kPanel;
  panel.width = 420_mm;
  panel.height = 280_mm;
  panel.created_at = kNow;
  if (!Panels(*database).add(panel, {}, {}).ok()) std::abort();
  return std::move(*database);
}

// `count` square pieces side by side, 2k apart.
NewPlan grid_job(int count) {
  NewPlan job;
  job.planned_on = {{kPanel, 1}};
  constexpr int kColumns = 40;
  constexpr double kSide = 9, kPitch = 10;
  for (int i = 0; i < count; ++i) {
    PlannedPatch piece;
    piece.mark = fmt::format("A{}", i);
    const double x = kPitch * (i % kColumns), y = kPitch * (i / kColumns);
    for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {kSide, 0.0}, {kSide, kSide}, {0.0, kSide}}) {
      piece.artwork_outline.push_back(point<ArtworkFrame>(dx, dy));
      piece.panel_outline.push_back(point<PanelFrame>(x + dx, y + dy));
    }
    piece.panel = kPanel;
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), 0.3_mm);
    job.pieces.push_back(std::move(piece));
  }
  return job;
}

void BM_ReserveAWholePlan(benchmark::State& state) {
  const NewPlan job = grid_job(static_cast<int>(state.range(0)));
  const testing::TempDirectory directory;
  Database database = panel_database(directory);
  JobStore jobs(database);
  for (auto _ : state) {
    const auto created = jobs.create(job, kNow);
    if (!created.ok()) std::abort();
    state.PauseTiming();
    if (!jobs.cancel(*created, kNow).ok()) std::abort();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_ReserveAWholePlan)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

void BM_LiveAllocations(benchmark::State& state) {
  const testing::TempDirectory directory;
  Database database = panel_database(directory);
  if (!JobStore(database).create(grid_job(1000), kNow).ok()) std::abort();
  for (auto _ : state) benchmark::DoNotOptimize(Ledger(database).live_allocations(kPanel));
}
BENCHMARK(BM_LiveAllocations)->Unit(benchmark::kMillisecond);

// Asked at each change of the cell's state.
void BM_CountWorkOfAJob(benchmark::State& state) {
  const testing::TempDirectory directory;
  Database database = panel_database(directory);
  JobStore jobs(database);
  if (!jobs.create(grid_job(1000), kNow).ok()) std::abort();
  for (auto _ : state) benchmark::DoNotOptimize(jobs.with_work());
}
BENCHMARK(BM_CountWorkOfAJob)->Unit(benchmark::kMicrosecond);

void BM_FreeWoodOfAFullPanel(benchmark::State& state) {
  std::vector<Region<PanelFrame>> areas;
  for (const auto& piece : grid_job(1000).pieces) areas.push_back(piece.allocation);
  const Region<PanelFrame> panel(Ring<PanelFrame>{point<PanelFrame>(0, 0), point<PanelFrame>(420, 0),
                                                  point<PanelFrame>(420, 280), point<PanelFrame>(0, 280)});
  for (auto _ : state) benchmark::DoNotOptimize(subtract(panel, unite(areas)));
}
BENCHMARK(BM_FreeWoodOfAFullPanel)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace veneer::db
