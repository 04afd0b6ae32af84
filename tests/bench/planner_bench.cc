// The planner against exhaustive matching in the spectrum, in one run: the whole command, the time a patch takes once
// the index stands, memory, and how much more its choices cost than the best there are.
//
// Pictures come from the developer's data set beside the sources (VENEER_DATA names another folder); without it, wood
// is grown. VENEER_BENCH_PATCHES sets how many patches are compared (40), which is most of the time it takes.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>

#include "drivers/sim/wood.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/pictures/features.h"
#include "planner/pictures/pictures.h"
#include "planner/problem/problem.h"
#include "tests/bench/data_folder.h"
#include "tests/support/child_process.h"
#include "tests/support/exhaustive_matching.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

constexpr int kThreads = 2;
constexpr double kDpi = 300;
constexpr double kMiss = 0.001;  // a choice that costs more than this part above the best one is a miss

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

// Of this process, or of the programs it has run: what a machine with other work to do does not change.
double cpu_seconds(int whose) {
  struct rusage usage {};
  getrusage(whose, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

[[noreturn]] void fail(const std::string& sentence) {
  fmt::print(stderr, "planner_bench: {}\n", sentence);
  std::exit(1);
}

enum class Wood { kSmall, kLarge, kPaperQuarter, kPaper };

struct Case {
  std::string name;
  Wood wood;
  int patches;  // a side
  double patch_mm;
  double target_noise = 0, wood_noise = 0;  // standard deviations, grey values
  double size_mm() const { return patches * patch_mm; }
  bool unjudged() const { return wood == Wood::kPaperQuarter || wood == Wood::kPaper; }  // too large for the oracle
};

constexpr double k48Pixels = 48 / kDpi * 25.4;

std::size_t compared_patches() {
  const char* wanted = std::getenv("VENEER_BENCH_PATCHES");  // NOLINT(concurrency-mt-unsafe)
  return wanted != nullptr ? static_cast<std::size_t>(std::max(1, std::atoi(wanted))) : 40;
}

void save(const fs::path& path, const cv::Mat& picture) {
  if (!cv::imwrite(path.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 1})) fail("cannot write " + path.string());
}

cv::Mat noisy(const cv::Mat& picture, double sigma, std::uint64_t seed) {
  cv::Mat noise(picture.size(), CV_16SC3), out;
  cv::RNG(seed).fill(noise, cv::RNG::NORMAL, cv::Scalar::all(0), cv::Scalar::all(sigma));
  picture.convertTo(out, CV_16SC3);
  out += noise;
  out.convertTo(out, CV_8UC3);
  return out;
}

// Strips of grown wood side by side on a light board, with a hole in each.
void grow_panel(cv::Size size, cv::Mat& picture, cv::Mat& mask) {
  constexpr int kStrips = 6, kGap = 6;
  picture = cv::Mat(size, CV_8UC3, cv::Scalar::all(230));
  mask = cv::Mat(size, CV_8UC1, cv::Scalar(0));
  const auto& species = sim::wood_species();
  for (int i = 0; i < kStrips; ++i) {
    const cv::Rect strip(i * size.width / kStrips + kGap, 3 * kGap, size.width / kStrips - 2 * kGap,
                         size.height - 6 * kGap);
    sim::grow_wood(species[static_cast<std::size_t>(i) % species.size()], strip.size(), kDpi / 25.4,
                   static_cast<std::uint64_t>(i) + 1)
        .copyTo(picture(strip));
    mask(strip).setTo(255);
    cv::circle(mask, {strip.x + strip.width / 2, strip.height * (i + 1) / (kStrips + 1)}, 20, cv::Scalar(0), -1);
  }
}

// Like the paper's panel, tiled from single textures, mirrored where they meet.
void tile_panel(cv::Size size, const fs::path& wood, cv::Mat& picture, cv::Mat& mask) {
  picture = cv::Mat(size, CV_8UC3, cv::Scalar::all(230));
  mask = cv::Mat(size, CV_8UC1, cv::Scalar(0));
  const std::vector<std::string> names{"oak_veneer",     "rosewood_veneer", "plywood",      "red_table_wood",
                                       "grey_weathered", "brown_figured",   "orange_ringed"};
  constexpr int kGap = 8;
  int left = kGap;
  for (std::size_t i = 0; left + 2 * kGap < size.width; ++i) {
    const cv::Mat tile = cv::imread((wood / (names[i % names.size()] + ".jpg")).string());
    if (tile.empty()) fail("the wood's textures are missing");
    const int width = std::min(tile.cols, size.width - left - kGap);
    for (int top = 0, k = 0; top < size.height; top += tile.rows, ++k) {
      cv::Mat turned = tile;
      if (k % 2 == 1) cv::flip(tile, turned, 0);
      const int height = std::min(tile.rows, size.height - top);
      turned(cv::Rect(0, 0, width, height)).copyTo(picture(cv::Rect(left, top, width, height)));
    }
    mask(cv::Rect(left + kGap, kGap, width - 2 * kGap, size.height - 2 * kGap)).setTo(255);
    left += width + kGap;
  }
}

// The files of a case, as a user would give them.
struct Files {
  testing::TempDirectory directory;
  fs::path target, panel, mask;
};

void make_pictures(const Case& it, Files& files) {
  const fs::path data = bench::data_folder();
  const std::string name = it.wood == Wood::kSmall ? "panel_small" : "panel_large";
  cv::Mat picture, mask;
  if (it.unjudged()) {
    tile_panel(it.wood == Wood::kPaper ? cv::Size(17700, 11800) : cv::Size(8850, 5900), data / "wood", picture, mask);
  } else if (fs::exists(data / "wood" / (name + ".jpg"))) {
    files.panel = data / "wood" / (name + ".jpg"), files.mask = data / "wood" / (name + "_mask.png");
  } else {
    grow_panel(it.wood == Wood::kSmall ? cv::Size(1500, 1200) : cv::Size(3000, 2400), picture, mask);
  }
  if (it.wood_noise > 0) {
    if (picture.empty()) picture = cv::imread(files.panel.string()), mask = cv::imread(files.mask.string(), 0);
    picture = noisy(picture, it.wood_noise, 1);
  }
  if (!picture.empty()) {
    files.panel = files.directory / "panel.png", files.mask = files.directory / "mask.png";
    save(files.panel, picture), save(files.mask, mask);
  }
  files.target = data / "targets" / "astronaut_head.png";
  if (fs::exists(files.target) && it.target_noise == 0) return;
  cv::Mat target = cv::imread(files.target.string());
  if (target.empty()) {
    target = cv::Mat(260, 260, CV_8UC3, cv::Scalar(90, 100, 120));
    cv::circle(target, {130, 110}, 70, cv::Scalar(140, 170, 220), cv::FILLED, cv::LINE_AA);
    cv::circle(target, {105, 95}, 9, cv::Scalar(40, 40, 50), cv::FILLED, cv::LINE_AA);
    cv::circle(target, {155, 95}, 9, cv::Scalar(40, 40, 50), cv::FILLED, cv::LINE_AA);
    cv::ellipse(target, {130, 140}, {30, 12}, 0, 0, 180, cv::Scalar(60, 60, 160), 4, cv::LINE_AA);
    cv::GaussianBlur(target, target, {}, 1.5);
  }
  if (it.target_noise > 0) {
    // As fine as the working resolution: what an enlarged photograph's noise is after sharpening, at its worst.
    const int side = static_cast<int>(std::lround(it.size_mm() / 25.4 * kDpi));
    cv::resize(target, target, {side, side}, 0, 0, cv::INTER_LINEAR);
    target = noisy(target, it.target_noise, 2);
  }
  files.target = files.directory / "target.png";
  save(files.target, target);
}

// `veneerctl plan`, as a program of its own.
struct Run {
  double wall = 0, cpu = 0;
  nlohmann::json report;
};

Run plan_by_command(const Case& it, const Files& files, const std::vector<std::string>& tier) {
  const fs::path out = files.directory / "out";
  std::string command = fmt::format(
      "{} plan --target {} --panel {},mask={},dpi={} --size-mm {} --patch-mm {} --dpi {} --rotations 15 --threads {} "
      "--out {}",
      VENEERCTL, files.target.string(), files.panel.string(), files.mask.string(), kDpi, it.size_mm(), it.patch_mm,
      kDpi, kThreads, out.string());
  for (const std::string& option : tier) command += " " + option;
  const auto start = SteadyClock::now();
  const double cpu_before = cpu_seconds(RUSAGE_CHILDREN);
  // A shell between us, because a program inherits the peak of what it was started from.
  const auto finished = tests::run_program({"/bin/sh", "-c", command + "; exit $?"});
  Run run;
  run.wall = seconds_since(start), run.cpu = cpu_seconds(RUSAGE_CHILDREN) - cpu_before;
  if (finished.status != 0) fail(finished.output);
  std::ifstream file(out / "report.json");
  run.report = nlohmann::json::parse(file, nullptr, false);
  if (run.report.is_discarded()) fail("the report cannot be read");
  return run;
}

// A case with the oracle's answers, found once for all tiers.
struct Judged {
  Files files;
  PlanOptions options;
  Problem problem;
  std::vector<std::size_t> sample;  // of problem.queue
  std::vector<test::ExhaustiveMatching::Answer> best;
  double oracle_seconds = 0, oracle_cpu = 0;  // a patch
};

template <class T>
T must(Result<T> result) {
  if (!result.ok()) fail(result.error().message);
  return std::move(*result);
}

std::unique_ptr<Judged> judge(const Case& it) {
  auto judged = std::make_unique<Judged>();
  make_pictures(it, judged->files);
  PlanOptions& options = judged->options;
  options.patch = Millimetres(it.patch_mm), options.dpi = kDpi, options.threads = kThreads;
  if (it.unjudged()) return judged;

  const cv::Mat picture = must(load_picture(judged->files.target));
  const ArtworkSize size = artwork_size(picture, Millimetres(it.size_mm()));
  const Artwork artwork{"target", "A", picture, size.width, size.height};
  StockPanel panel;
  panel.id = {"panel"};
  panel.picture.pixels = must(load_picture(judged->files.panel));
  panel.picture.resolution = panel.free.resolution = ScanResolution::from_dpi(kDpi);
  panel.free.pixels = must(load_mask(judged->files.mask));
  judged->problem = must(make_problem(std::span(&artwork, 1), std::span(&panel, 1), options));
  const Problem& problem = judged->problem;

  std::vector<std::size_t> all(problem.queue.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  std::mt19937 random(1);
  std::sample(all.begin(), all.end(), std::back_inserter(judged->sample), compared_patches(), random);
  test::ExhaustiveMatching oracle(problem.panels, turns(options.rotations), kThreads);
  for (const std::size_t i : judged->sample) {
    judged->best.push_back(oracle.best(problem.queue[i].match));
    judged->oracle_seconds += judged->best.back().seconds / static_cast<double>(judged->sample.size());
    judged->oracle_cpu += judged->best.back().cpu_seconds / static_cast<double>(judged->sample.size());
  }
  return judged;
}

Judged& judged(const Case& it) {
  static std::map<std::string, std::unique_ptr<Judged>> known;
  auto& entry = known[it.name];
  if (!entry) entry = judge(it);
  return *entry;
}

std::unique_ptr<Matcher> indexed_matcher(const Judged& judged, bool exact) {
  const Problem& problem = judged.problem;
  const auto all_turns = turns(judged.options.rotations);
  std::unique_ptr<Matcher> matcher;
  if (exact)
    matcher = std::make_unique<CertifiedMatcher>(problem.panels, all_turns, problem.classes, problem.entries_per_unit);
  else
    matcher = std::make_unique<ShortlistMatcher>(problem.panels, all_turns, problem.classes,
                                                 largest_response(judged.options));
  if (!matcher->build_index(kThreads, {}).ok()) std::abort();
  return matcher;
}

// Choices against the cheapest ones, as parts of their costs.
struct Ratios {
  double found = 0, best = 0, worst = 1, misses = 0, compared = 0;
  void add(double found_cost, double best_cost) {
    found += found_cost, best += best_cost, compared += 1;
    worst = std::max(worst, found_cost / best_cost);
    misses += found_cost > best_cost * (1 + kMiss) ? 1 : 0;
  }
};

// First choices on untouched wood against the oracle's.
Ratios first_choices(const Judged& judged, const Matcher& matcher) {
  Ratios ratios;
  for (std::size_t i = 0; i < judged.sample.size(); ++i) {
    const auto found = *matcher.best(judged.problem.queue[judged.sample[i]].match, {});
    const auto& best = judged.best[i].best;
    if (found.has_value() != best.has_value()) fail("one finds a place where the other finds none");
    if (found) ratios.add(found->cost, best->cost);
  }
  return ratios;
}

// All choices of a greedy run against the certified search on the same wood, which the oracle proves right above.
Ratios greedy_choices(const Judged& judged, Matcher& matcher) {
  Ratios ratios;
  const std::unique_ptr<Matcher> certified = indexed_matcher(judged, true);
  for (const Problem::Task& task : judged.problem.queue) {
    const auto found = *matcher.best(task.match, {}), best = *certified->best(task.match, {});
    if (found.has_value() != best.has_value()) fail("one finds a place where the other finds none");
    if (!found) continue;
    ratios.add(found->cost, best->cost);
    matcher.take(task.match, *found), certified->take(task.match, *found);
  }
  return ratios;
}

void compare_choices(benchmark::State& state, const Case& it, bool exact) {
  const Judged& known = judged(it);
  std::unique_ptr<Matcher> matcher;
  const double start_cpu = cpu_seconds(RUSAGE_SELF);
  for (auto _ : state) matcher = indexed_matcher(known, exact);
  const double indexed_cpu = cpu_seconds(RUSAGE_SELF);
  const Ratios first = first_choices(known, *matcher);
  // On whole wood, one after another.
  state.counters["index_cpu_s"] = indexed_cpu - start_cpu;
  state.counters["patch_cpu_s"] = (cpu_seconds(RUSAGE_SELF) - indexed_cpu) / first.compared;
  state.counters["oracle_patch_cpu_s"] = known.oracle_cpu;
  state.counters["compared"] = first.compared;
  state.counters["cost_ratio"] = first.found / first.best;
  state.counters["cost_ratio_worst"] = first.worst;
  state.counters["misses"] = first.misses;
  if (exact) return;
  const Ratios all = greedy_choices(known, *matcher);
  state.counters["greedy_compared"] = all.compared;
  state.counters["greedy_cost_ratio"] = all.found / all.best;
  state.counters["greedy_cost_ratio_worst"] = all.worst;
  state.counters["greedy_misses"] = all.misses;
}

void plan_case(benchmark::State& state, const Case& it, const std::vector<std::string>& tier) {
  Judged& known = judged(it);
  Run run;
  for (auto _ : state) {
    run = plan_by_command(it, known.files, tier);
    state.SetIterationTime(run.wall);
  }
  const auto& spent = run.report["seconds"];
  const auto part = [&](const char* name) { return spent.value(name, 0.0); };
  const double filled = run.report.value("pieces", 0.0) - run.report.value("unfilled", 0.0);
  const double plan_seconds = part("load") + part("features") + part("match") + part("refine");
  state.counters["filled"] = filled;
  state.counters["unfilled"] = run.report.value("unfilled", 0.0);
  state.counters["cost_total"] = run.report.value("cost_total", 0.0);
  state.counters["index_s"] = part("load") + part("features");
  state.counters["plan_s"] = plan_seconds;
  state.counters["patch_s"] = part("match") / filled;
  state.counters["run_cpu_s"] = run.cpu;
  state.counters["peak_mb"] = run.report.value("peak_rss_bytes", 0.0) / 1e6;
  if (known.best.empty()) return;
  state.counters["oracle_patch_s"] = known.oracle_seconds;
  state.counters["x_run"] = known.oracle_seconds * filled / run.wall;
  state.counters["x_plan"] = known.oracle_seconds * filled / plan_seconds;
  state.counters["oracle_patch_cpu_s"] = known.oracle_cpu;
  state.counters["x_run_cpu"] = known.oracle_cpu * filled / run.cpu;
  state.counters["x_patch"] = known.oracle_seconds * filled / part("match");
}

const int kRegistered = [] {
  const std::vector<Case> cases{{"planner/small_48px", Wood::kSmall, 14, k48Pixels},
                                {"planner/large_48px", Wood::kLarge, 20, k48Pixels},
                                {"planner/small_165px", Wood::kSmall, 4, 14},
                                {"planner/large_165px", Wood::kLarge, 10, 14},
                                {"planner/small_48px_noisy_target", Wood::kSmall, 14, k48Pixels, 25, 0},
                                {"planner/small_48px_noisy_wood", Wood::kSmall, 14, k48Pixels, 0, 15},
                                {"paper_panel_quarter_48px", Wood::kPaperQuarter, 8, k48Pixels},
                                // 1500 x 1000 mm, the paper's own.
                                {"paper_panel_48px", Wood::kPaper, 8, k48Pixels}};
  const std::vector<std::pair<std::string, std::vector<std::string>>> tiers{{"shortlist", {}}, {"exact", {"--exact"}}};
  for (const Case& it : cases) {
    for (const auto& [name, options] : tiers) {
      benchmark::RegisterBenchmark((it.name + "/" + name).c_str(),
                                   [it, options = options](benchmark::State& state) { plan_case(state, it, options); })
          ->Iterations(1)
          ->UseManualTime()
          ->Unit(benchmark::kSecond);
      if (it.unjudged()) continue;
      // What it costs, apart from how long it takes: this part takes minutes.
      benchmark::RegisterBenchmark(
          (it.name + "/" + name + "_choices").c_str(),
          [it, exact = !options.empty()](benchmark::State& state) { compare_choices(state, it, exact); })
          ->Iterations(1)
          ->Unit(benchmark::kSecond);
    }
  }
  return 0;
}();

}  // namespace
}  // namespace veneer::planner
