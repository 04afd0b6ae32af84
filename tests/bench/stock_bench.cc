// The memory of a cell after years of work: 1,000 panels, from each of which 1,000 pieces were cut (VENEER_BENCH_PANELS
// makes fewer panels, VENEER_BENCH_PIECES fewer pieces). They share one map and one mask, which the daemon reads for
// each of them all the same. The database is made once, in a temporary folder on the disk, which takes some minutes;
// with VENEER_BENCH_STOCK it is made in that folder, and used again by the next run.
//
// Its goals are kWanted, at full size; a smaller one keeps them more easily. A run that misses one fails (goals.h).
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <random>
#include <span>

#include "base/files.h"
#include "cli/api_client.h"
#include "daemon/stock/area_book.h"
#include "daemon/unit/kept_cuts.h"
#include "db/job_store.h"
#include "db/materials.h"
#include "db/panels.h"
#include "db/sql.h"
#include "planner/pictures/png_codec.h"
#include "tests/bench/goals.h"
#include "tests/db/raw_writer.h"
#include "tests/support/burnt_piece.h"
#include "tests/support/campaign_size.h"
#include "tests/support/lone_daemon.h"
#include "tests/support/temp_directory.h"

namespace veneer::db {
namespace {

namespace fs = std::filesystem;
const std::string kThen = "2026-05-01T07:30:00.000Z";
constexpr int kColumns = 41;  // of 41 x 27 places on a panel
const int kCutFromEach = static_cast<int>(testing::number_from("VENEER_BENCH_PIECES", 1000));

// A plan of 500 pieces is reserved in 200 ms, a panel's wood read and its picture sent in 50 ms, also one that has to
// be drawn, all panels are listed or searched in 100 ms, also by a daemon that was killed and started again, which is
// ready in 2 s; a piece of a grid takes 1 KB of database and a curved one 3 KB, without plan files, also where of each
// piece it is kept how the last run cut it.
const bool kWanted = bench::Goals::all().add({
    {"BM_stock_reserve_500_pieces", "time", 200, "ms"},
    {"BM_stock_wood_of_a_panel", "time", 50, "ms"},
    {"BM_stock_list_of_panels", "time", 100, "ms"},
    {"BM_stock_daemon_starts", "time", 2000, "ms"},
    {"BM_stock_daemon_starts_after_a_kill", "time", 2000, "ms"},
    {"BM_stock_panels_asked_for", "time", 100, "ms"},
    {"BM_stock_panels_asked_for", "after_kill_ms", 100, "ms"},
    {"BM_stock_searched_for_wood", "time", 100, "ms"},
    {"BM_stock_searched_for_wood", "after_kill_ms", 100, "ms"},
    {"BM_stock_searched_for_any_patch", "time", 100, "ms"},
    {"BM_stock_searched_for_a_species", "time", 100, "ms"},
    {"BM_stock_searched_for_a_species", "after_kill_ms", 100, "ms"},
    {"BM_stock_piece_asked_for", "time", 100, "ms"},
    {"BM_stock_place_asked_for", "time", 100, "ms"},
    {"BM_stock_picture_of_a_panel", "time", 50, "ms"},
    {"BM_stock_picture_drawn_anew", "time", 50, "ms"},
    {"BM_stock_picture_of_a_panel_jpeg", "time", 50, "ms"},
    {"BM_stock_picture_drawn_anew_jpeg", "time", 50, "ms"},
    {"BM_stock_bytes_a_piece/4", "bytes", 1000, "bytes"},
    {"BM_stock_bytes_a_piece/48", "bytes", 3000, "bytes"},
    {"BM_stock_bytes_a_kept_piece/4", "bytes", 1000, "bytes"},
    {"BM_stock_bytes_a_kept_piece/48", "bytes", 3000, "bytes"},
    {"BM_stock_raw_writers", "p99_ms", 50, "ms"},
    {"BM_stock_raw_writers_at_size", "p99_ms", 50, "ms"},
});

template <class T>
T sure(Result<T> result) {
  if (result.ok()) return std::move(result).value();
  fmt::print(stderr, "{}\n", result.error().message);
  std::abort();
}
void sure(const Status& status) {
  if (status.ok()) return;
  fmt::print(stderr, "{}\n", status.error().message);
  std::abort();
}

PanelId panel_number(int number) { return PanelId{fmt::format("P-{:04d}", number)}; }

PanelRecord a_panel(int number) {
  PanelRecord panel;
  panel.id = panel_number(number);
  panel.name = "walnut and maple";
  panel.width = 420_mm;
  panel.height = 280_mm;
  panel.usable = SquareMillimetres(110'000);
  panel.map_file = "maps/map.png", panel.mask_file = "maps/mask.png";
  panel.created_at = kThen;
  return panel;
}

// The `place`-th of a grid of 10 mm: a square, or a curved piece with `corners` of them.
PlannedPatch a_piece(int place, int corners = 4) {
  PlannedPatch piece;
  piece.mark = fmt::format("A{}-{}", place / kColumns + 1, place % kColumns + 1);
  const double x = 5 + 10.0 * (place % kColumns), y = 5 + 10.0 * (place / kColumns);
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * (i + 0.5) / corners;
    const double radius = corners == 4 ? 4.5 * std::sqrt(2.0) : 4.2 + 0.3 * std::sin(3 * angle);
    const double dx = radius * std::cos(angle), dy = radius * std::sin(angle);
    piece.artwork_outline.push_back(point<ArtworkFrame>(x + dx, y + dy));
    piece.panel_outline.push_back(point<PanelFrame>(x + dx, y + dy));
  }
  piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), 0.3_mm);
  return piece;
}

NewPlan a_plan(const PanelId& panel, std::vector<PlannedPatch> pieces) {
  NewPlan plan;
  plan.name = "portrait";
  plan.plan_json = plan.options_json = "{}";
  for (PlannedPatch& piece : pieces) piece.panel = panel;
  plan.planned_on = {{panel, 1}};
  plan.pieces = std::move(pieces);
  return plan;
}

void cut_all(Database& database, JobId job, const PanelId& panel) {
  JobStore jobs(database);
  const RunId run = sure(jobs.start_run(job, panel, {}, 0.05_mm, kThen, {"uid 1000", {}, "[]"}));
  for (const char* state : {"cutting", "cut"})
    sure(in_transaction(database, [&](SQLite::Database& connection) -> Status {
      connection.exec(fmt::format("UPDATE allocations SET state = '{}' WHERE job = {}", state, job.value));
      return Ok();
    }));
  sure(jobs.finish_run(run, false, kThen));
}

class Stock {
 public:
  static Stock& get() {
    static Stock stock;
    return stock;
  }
  int panels() const { return panels_; }
  Database& database() {
    if (!database_) database_.emplace(sure(Database::open(file())));
    return *database_;
  }
  fs::path folder() {
    database_.reset();  // in order
    return folder_;
  }

 private:
  Stock() {
    fmt::print(stderr, "Of {} panels x {} pieces\n", panels_, kCutFromEach);
    const char* kept = std::getenv("VENEER_BENCH_STOCK");  // NOLINT(concurrency-mt-unsafe): nothing sets it
    if (kept == nullptr) temporary_.emplace(testing::TempDirectory::Place::kDisk);
    folder_ = kept == nullptr ? temporary_->path() : fs::path(kept);
    if (fs::exists(file())) {
      panels_ = static_cast<int>(sure(Panels(database()).list()).size());
      name_woods();
      return;
    }
    make_pictures();
    std::vector<PlannedPatch> pieces;
    for (int i = 0; i < kCutFromEach; ++i) pieces.push_back(a_piece(i));
    for (int number = 1; number <= panels_; ++number) {
      sure(Panels(database()).add(a_panel(number), {}, {}));
      const PanelId panel = panel_number(number);
      cut_all(database(), sure(JobStore(database()).create(a_plan(panel, pieces), kThen)), panel);
      if (number % 100 == 0) fmt::print(stderr, "{} panels of {}\n", number, panels_);
    }
    name_woods();
  }
  // The left of each panel is maple, the right walnut; also in a stock that was made before they had a name.
  void name_woods() {
    Materials materials(database());
    if (!sure(materials.woods()).empty()) return;
    const auto strip = [](double from_mm, double to_mm) {
      return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(from_mm, 0), point<PanelFrame>(to_mm, 0),
                                                 point<PanelFrame>(to_mm, 280), point<PanelFrame>(from_mm, 280)});
    };
    for (int number = 1; number <= panels_; ++number)
      sure(materials.add_zones(panel_number(number), {{1, strip(0, 210), "maple"}, {2, strip(210, 420), "walnut"}}));
  }
  fs::path file() const { return folder_ / "veneerd.db"; }
  // 420 x 280 mm at 300 dpi: light wood on the left, dark on the right, with the noise of a scan.
  void make_pictures() const {
    constexpr int kWidth = 4961, kHeight = 3307;
    cv::Mat map(kHeight, kWidth, CV_8UC3, cv::Scalar(150, 190, 220)), noise(kHeight, kWidth, CV_8UC3);
    map.colRange(kWidth / 2, kWidth) = cv::Scalar(40, 60, 80);
    cv::theRNG().state = 1;
    cv::randn(noise, cv::Scalar::all(20), cv::Scalar::all(6));
    map += noise;
    cv::Mat mask(kHeight, kWidth, CV_8UC1, cv::Scalar(0));
    mask(cv::Rect(20, 20, kWidth - 40, kHeight - 40)) = 255;
    for (const auto& [picture, name] : {std::pair(map, "map.png"), std::pair(mask, "mask.png")}) {
      const auto png = planner::encode_png(picture);
      if (!png) std::abort();
      sure(write_whole(folder_ / "maps" / name, std::as_bytes(std::span(*png))));
    }
  }

  int panels_ = static_cast<int>(testing::number_from("VENEER_BENCH_PANELS", 1000));
  std::optional<testing::TempDirectory> temporary_;
  fs::path folder_;
  std::optional<Database> database_;
};

void BM_stock_reserve_500_pieces(benchmark::State& state) {
  Database& database = Stock::get().database();
  JobStore jobs(database);
  NewPlan plan = a_plan(panel_number(1), {});
  plan.planned_on.clear();
  for (int i = 0; i < 5; ++i) {
    const PanelId panel = panel_number(1 + i * Stock::get().panels() / 5);
    plan.planned_on.push_back({panel, 1});
    for (int k = 0; k < 100; ++k) {
      plan.pieces.push_back(a_piece(kCutFromEach + k));
      plan.pieces.back().panel = panel;
      plan.pieces.back().mark = fmt::format("B{}-{}", i, k);
    }
  }
  for (auto _ : state) {
    const JobId job = sure(jobs.create(plan, kThen));
    state.PauseTiming();
    sure(jobs.cancel(job, kThen));
    state.ResumeTiming();
  }
}
BENCHMARK(BM_stock_reserve_500_pieces)->Unit(benchmark::kMillisecond)->Iterations(20);

void BM_stock_wood_of_a_panel(benchmark::State& state) {
  Ledger ledger(Stock::get().database());
  std::mt19937 random(1);
  for (auto _ : state)
    benchmark::DoNotOptimize(sure(ledger.live_allocations(
        panel_number(1 + static_cast<int>(random() % static_cast<unsigned>(Stock::get().panels()))))));
}
BENCHMARK(BM_stock_wood_of_a_panel)->Unit(benchmark::kMillisecond);

void BM_stock_piece_at_a_point(benchmark::State& state) {
  Ledger ledger(Stock::get().database());
  std::mt19937 random(1);
  for (auto _ : state)
    benchmark::DoNotOptimize(sure(ledger.allocations_at(
        panel_number(1 + static_cast<int>(random() % static_cast<unsigned>(Stock::get().panels()))),
        point<PanelFrame>(105, 55))));
}
BENCHMARK(BM_stock_piece_at_a_point)->Unit(benchmark::kMillisecond);

void BM_stock_list_of_panels(benchmark::State& state) {
  Panels panels(Stock::get().database());
  for (auto _ : state) benchmark::DoNotOptimize(sure(panels.in_stock()));
}
BENCHMARK(BM_stock_list_of_panels)->Unit(benchmark::kMillisecond);

void BM_stock_list_of_jobs(benchmark::State& state) {
  JobStore jobs(Stock::get().database());
  for (auto _ : state) benchmark::DoNotOptimize(sure(jobs.list(JobId{0}, 500)));
}
BENCHMARK(BM_stock_list_of_jobs)->Unit(benchmark::kMillisecond);

// With a laser that is a file, and this data folder.
void start_on(tests::LoneDaemon& daemon, const fs::path& folder) {
  tests::LoneDaemonOptions options;
  options.data = folder;
  sure(daemon.start(fs::read_symlink("/proc/self/exe").parent_path(),
                    fmt::format("kind = \"grbl\"\nport = \"file:{}\"\n", (folder / "laser.gcode").string()), options));
}

// Of the processors, what it has had so far, all its threads together but the one that counts what is left of panels
// beside all else (remnant_clerk.h); in milliseconds.
double processor_ms(const tests::LoneDaemon& daemon) {
  double out = 0;
  for (const auto& thread : fs::directory_iterator(fmt::format("/proc/{}/task", daemon.pid()))) {
    std::string name;
    std::getline(std::ifstream(thread.path() / "comm"), name);
    double nanoseconds = 0;
    if (name != "remnants" && std::ifstream(thread.path() / "schedstat") >> nanoseconds) out += nanoseconds / 1e6;
  }
  return out;
}

// From its start to its first answer, after an orderly end.
void BM_stock_daemon_starts(benchmark::State& state) {
  const fs::path folder = Stock::get().folder();
  double processor = 0;
  for (auto _ : state) {
    tests::LoneDaemon daemon;
    start_on(daemon, folder);
    state.PauseTiming();
    processor += processor_ms(daemon);
    daemon.end();
    state.ResumeTiming();
  }
  state.counters["daemon_cpu_ms"] = processor / static_cast<double>(state.iterations());
}
BENCHMARK(BM_stock_daemon_starts)->Unit(benchmark::kMillisecond)->Iterations(5)->UseRealTime();

std::string state_of_database(const tests::LoneDaemon& daemon) {
  const auto status = daemon.api().get("/status");
  return status ? (*status)["database"].value("state", "") : "";
}

void await_check(const tests::LoneDaemon& daemon) {
  sure(daemon.wait_for([&] { return state_of_database(daemon) == "good"; }) ? Ok()
                                                                            : Error{ErrorCode::kTimeout, "no check"});
}

// The same after it was killed, so that the file is checked beside it.
void BM_stock_daemon_starts_after_a_kill(benchmark::State& state) {
  const fs::path folder = Stock::get().folder();
  tests::LoneDaemon daemon;
  start_on(daemon, folder);
  for (auto _ : state) sure(daemon.kill_and_start_again());
  // In order, for the next one.
  await_check(daemon);
}
BENCHMARK(BM_stock_daemon_starts_after_a_kill)->Unit(benchmark::kMillisecond)->Iterations(3)->UseRealTime();

// Of its memory, what is there; in MB.
double resident_mb(const tests::LoneDaemon& daemon) {
  std::ifstream statm(fmt::format("/proc/{}/statm", daemon.pid()));
  double size = 0, resident = 0;
  statm >> size >> resident;
  return resident * 4096 / 1e6;
}

// What a client waits for; in milliseconds. What has to be counted first may take longer than the daemon lets anybody
// wait; it is counted all the same.
double asked(tests::LoneDaemon& daemon, const std::string& target) {
  const cli::ApiClient patient({daemon.socket(), "", 0}, std::chrono::minutes(10));
  const auto began = std::chrono::steady_clock::now();
  auto answer = patient.get_bytes(target);
  while (!answer.ok() && answer.error().code == ErrorCode::kTimeout) answer = patient.get_bytes(target);
  sure(answer);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
}

// What the daemon answers: the first time, the first time after it was killed, and then as it knows it. `look` looks at
// the last answer.
template <class Look>
void ask_again_and_again(benchmark::State& state, const std::string& target, Look look) {
  tests::LoneDaemon daemon;
  start_on(daemon, Stock::get().folder());
  state.counters["first_ms"] = asked(daemon, target);
  sure(daemon.kill_and_start_again());
  state.counters["after_kill_ms"] = asked(daemon, target);
  // Then the check of the database, which takes a processor for as long as it lasts, is over.
  await_check(daemon);
  const double before = processor_ms(daemon);
  std::string last;
  for (auto _ : state) last = sure(daemon.api().get_bytes(target));
  state.counters["daemon_cpu_ms"] = (processor_ms(daemon) - before) / static_cast<double>(state.iterations());
  state.counters["rss_mb"] = resident_mb(daemon);
  look(last);
}
void ask_again_and_again(benchmark::State& state, const std::string& target) {
  ask_again_and_again(state, target, [](const std::string& /*answer*/) {});
}

// All panels with their figures, the first time as by a daemon that knows nothing of them.
void BM_stock_panels_asked_for(benchmark::State& state) {
  fs::remove(Stock::get().folder() / "stock-memory.json");
  ask_again_and_again(state, "/panels?limit=1000");
}
BENCHMARK(BM_stock_panels_asked_for)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

void BM_stock_searched_for_wood(benchmark::State& state) {
  ask_again_and_again(state, "/panels?limit=1000&tone=dark&patch_mm=14&min_free_mm2=1000");
}
BENCHMARK(BM_stock_searched_for_wood)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

void BM_stock_searched_for_a_species(benchmark::State& state) {
  ask_again_and_again(state, "/panels?limit=1000&wood=walnut&patch_mm=14&min_free_mm2=1000",
                      [&state](const std::string& answer) {
                        const auto found = nlohmann::json::parse(answer).at("panels").size();
                        state.counters["found"] = static_cast<double>(found);
                        // A search that finds none goes a shorter way than the one that is to be measured.
                        if (found == 0) sure(Error{ErrorCode::kNotFound, "no panel has walnut in patches of 14 mm"});
                      });
}
BENCHMARK(BM_stock_searched_for_a_species)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

// Each time another one, of whatever panel.
template <class Target>
void ask_of_each(benchmark::State& state, Target target) {
  tests::LoneDaemon daemon;
  start_on(daemon, Stock::get().folder());
  std::mt19937 random(1);
  asked(daemon, target(random));
  const double before = processor_ms(daemon);
  for (auto _ : state) benchmark::DoNotOptimize(sure(daemon.api().get_bytes(target(random))));
  state.counters["daemon_cpu_ms"] = (processor_ms(daemon) - before) / static_cast<double>(state.iterations());
}
int any_panel(std::mt19937& random) {
  return 1 + static_cast<int>(random() % static_cast<unsigned>(Stock::get().panels()));
}
void BM_stock_piece_asked_for(benchmark::State& state) {
  ask_of_each(state, [](std::mt19937& random) {
    return fmt::format("/pieces/{}", (any_panel(random) - 1) * std::int64_t{kCutFromEach} + 1);
  });
}
BENCHMARK(BM_stock_piece_asked_for)->Unit(benchmark::kMillisecond)->Iterations(50)->UseRealTime();

void BM_stock_place_asked_for(benchmark::State& state) {
  ask_of_each(state, [](std::mt19937& random) {
    return fmt::format("/panels/{}/place?x=105&y=5", panel_number(any_panel(random)).value);
  });
}
BENCHMARK(BM_stock_place_asked_for)->Unit(benchmark::kMillisecond)->Iterations(50)->UseRealTime();

// By a daemon that was killed, each time for patches of another size that nobody asked for before.
void BM_stock_searched_for_any_patch(benchmark::State& state) {
  tests::LoneDaemon daemon;
  start_on(daemon, Stock::get().folder());
  asked(daemon, "/panels?limit=1000&tone=dark&patch_mm=14&min_free_mm2=1000");  // what is counted once
  sure(daemon.kill_and_start_again());
  await_check(daemon);
  double patch = 2;
  std::size_t found = 0;
  const double before = processor_ms(daemon);
  for (auto _ : state) {
    const auto target = fmt::format("/panels?limit=1000&tone=dark&patch_mm={:.2f}&min_free_mm2=1000", patch += 0.37);
    const auto panels = daemon.api().get(target);
    sure(panels.ok() ? Ok() : Status(panels.error()));
    found += (*panels)["panels"].size();
  }
  state.counters["daemon_cpu_ms"] = (processor_ms(daemon) - before) / static_cast<double>(state.iterations());
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}
BENCHMARK(BM_stock_searched_for_any_patch)->Unit(benchmark::kMillisecond)->Iterations(20)->UseRealTime();

// Without loss, as the command line saves it.
void BM_stock_picture_of_a_panel(benchmark::State& state) { ask_again_and_again(state, "/panels/P-0001/stock.png"); }
BENCHMARK(BM_stock_picture_of_a_panel)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

// As the console shows it.
void BM_stock_picture_of_a_panel_jpeg(benchmark::State& state) {
  ask_again_and_again(state, "/panels/P-0001/stock.jpg");
}
BENCHMARK(BM_stock_picture_of_a_panel_jpeg)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();
void BM_stock_map_of_a_panel_jpeg(benchmark::State& state) { ask_again_and_again(state, "/panels/P-0001/map.jpg"); }
BENCHMARK(BM_stock_map_of_a_panel_jpeg)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

// Each time another panel's, as it was never drawn.
void draw_anew(benchmark::State& state, const char* picture) {
  tests::LoneDaemon daemon;
  start_on(daemon, Stock::get().folder());
  asked(daemon, fmt::format("/panels/P-0001/{}", picture));  // the map, which all of them share
  int next = 1;
  const double before = processor_ms(daemon);
  std::size_t bytes = 0;
  for (auto _ : state)
    bytes = sure(daemon.api().get_bytes(
                     fmt::format("/panels/{}/{}", panel_number(1 + next++ % Stock::get().panels()).value, picture)))
                .size();
  state.counters["daemon_cpu_ms"] = (processor_ms(daemon) - before) / static_cast<double>(state.iterations());
  state.counters["bytes"] = static_cast<double>(bytes);
}
void BM_stock_picture_drawn_anew(benchmark::State& state) { draw_anew(state, "stock.png"); }
BENCHMARK(BM_stock_picture_drawn_anew)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();
void BM_stock_picture_drawn_anew_jpeg(benchmark::State& state) { draw_anew(state, "stock.jpg"); }
BENCHMARK(BM_stock_picture_drawn_anew_jpeg)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

// What the area book of a panel looks at when nothing of it is known: 500 curved pieces, with their pixels.
void BM_area_book_of_500_pieces(benchmark::State& state) {
  const Raster<PanelFrame> mask{cv::Mat(3308, 4961, CV_8UC1, cv::Scalar(255)), ScanResolution::from_dpi(300)};
  std::vector<AllocationRecord> wood;
  for (int place = 0; place < 500; ++place) {
    const PlannedPatch piece = a_piece(place, 48);
    AllocationRecord& one = wood.emplace_back();
    one.state = AllocationState::kCut, one.area = piece.allocation, one.outline = piece.panel_outline;
  }
  const auto panel = daemon::whole_panel(420_mm, 280_mm);
  for (auto _ : state)
    for (const AllocationRecord& one : wood) benchmark::DoNotOptimize(daemon::booked_wood(one, mask, panel));
}
BENCHMARK(BM_area_book_of_500_pieces)->Unit(benchmark::kMillisecond);

// Cut pieces with `corners` each, their history included.
void BM_stock_bytes_a_piece(benchmark::State& state) {
  for (auto _ : state) {
    const testing::TempDirectory directory;
    constexpr int kPanels = 5;
    {
      Database database = sure(Database::open(directory / "veneerd.db"));
      std::vector<PlannedPatch> pieces;
      for (int i = 0; i < kCutFromEach; ++i) pieces.push_back(a_piece(i, static_cast<int>(state.range(0))));
      for (int number = 1; number <= kPanels; ++number) {
        sure(Panels(database).add(a_panel(number), {}, {}));
        const PanelId panel = panel_number(number);
        cut_all(database, sure(JobStore(database).create(a_plan(panel, pieces), kThen)), panel);
      }
    }
    state.counters["bytes"] = static_cast<double>(fs::file_size(directory / "veneerd.db")) / (kPanels * kCutFromEach);
  }
}
BENCHMARK(BM_stock_bytes_a_piece)->Arg(4)->Arg(48)->Unit(benchmark::kMillisecond)->Iterations(1);

// The same of a cell all of whose pieces were cut in its last run, so that how each was cut is kept. They are of one
// panel, so the schema, which is there once, is not counted.
void BM_stock_bytes_a_kept_piece(benchmark::State& state) {
  for (auto _ : state) {
    const testing::TempDirectory directory;
    static_cast<void>(sure(Database::open(directory / "empty.db")));
    const auto empty = fs::file_size(directory / "empty.db");
    {
      Database database = sure(Database::open(directory / "veneerd.db"));
      std::vector<PlannedPatch> pieces;
      for (int i = 0; i < kCutFromEach; ++i) pieces.push_back(a_piece(i, static_cast<int>(state.range(0))));
      sure(Panels(database).add(a_panel(1), {}, {}));
      JobStore jobs(database);
      const JobId job = sure(jobs.create(a_plan(panel_number(1), pieces), kThen));
      const RunId run = sure(jobs.start_run(job, panel_number(1), {}, 0.05_mm, kThen, {"uid 1000", {}, "[]"}));
      for (const PieceRecord& piece : sure(jobs.pieces(job))) {
        sure(jobs.mark_cutting(piece.id, kThen));
        const auto burn = sure(testing::burnt_piece(piece.id, piece.panel_outline));
        sure(jobs.book_and_keep(daemon::KeptCuts::to_record(burn, run, "GRBL 1.1h of serial 7"), kThen));
      }
      sure(jobs.finish_run(run, false, kThen));
    }
    state.counters["bytes"] = static_cast<double>(fs::file_size(directory / "veneerd.db") - empty) / kCutFromEach;
  }
}
BENCHMARK(BM_stock_bytes_a_kept_piece)->Arg(4)->Arg(48)->Unit(benchmark::kMillisecond)->Iterations(1);

// Programs that write past the daemon, on a panel of this file without wood.
void write_past_it(benchmark::State& state, const fs::path& file, const PanelId& panel) {
  constexpr int kWriters = 16;
  std::vector<double> waited;
  std::string surprise;
  for (auto _ : state)
    for (const Tally& tally : write_raw_at_once(file, panel, 0, kWriters, 300)) {
      if (!tally.surprises.empty()) surprise = tally.surprises.front();
      waited.insert(waited.end(), tally.waited_ms.begin(), tally.waited_ms.end());
    }
  if (!surprise.empty()) return state.SkipWithError(surprise.c_str());
  std::sort(waited.begin(), waited.end());
  const auto quantile = [&](double q) {
    return waited[static_cast<std::size_t>(q * (static_cast<double>(waited.size()) - 1))];
  };
  state.counters["p50_ms"] = quantile(0.5);
  state.counters["p99_ms"] = quantile(0.99);
  state.counters["most_ms"] = quantile(1);
}
void add_empty_panel(const fs::path& file, int number) {
  sure(Panels(*std::make_unique<Database>(sure(Database::open(file)))).add(a_panel(number), {}, {}));
}
void BM_stock_raw_writers(benchmark::State& state) {
  const testing::TempDirectory directory(testing::TempDirectory::Place::kDisk);
  add_empty_panel(directory / "veneerd.db", 1);
  write_past_it(state, directory / "veneerd.db", panel_number(1));
}
BENCHMARK(BM_stock_raw_writers)->Unit(benchmark::kMillisecond)->Iterations(2)->UseRealTime();

// The same on a copy of the whole stock, beside all that was cut.
void BM_stock_raw_writers_at_size(benchmark::State& state) {
  const testing::TempDirectory directory(testing::TempDirectory::Place::kDisk);
  const fs::path file = directory / "veneerd.db";
  fs::copy_file(Stock::get().folder() / "veneerd.db", file);
  const int one_more = Stock::get().panels() + 1;
  add_empty_panel(file, one_more);
  write_past_it(state, file, panel_number(one_more));
  state.counters["mb"] = static_cast<double>(fs::file_size(file)) / 1e6;
}
BENCHMARK(BM_stock_raw_writers_at_size)->Unit(benchmark::kMillisecond)->Iterations(2)->UseRealTime();

}  // namespace
}  // namespace veneer::db
