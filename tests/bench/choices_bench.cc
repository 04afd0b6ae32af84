// How good and how fast choices are where pictures are noisy and patches irregular, and what turning pieces finely
// gains.
//
// noisy/: first choices on whole wood by the shortlist against the certified search; Gaussian noise of the named
// standard deviation (of 255) is added to the target at the working resolution, to the panel's picture, or to both.
// irregular/: the same for triangles in four orientations, discs, uneven quadrilaterals, Ls, crescents, meanders and
// random stars in the candidate of squares. fine_rotation/: a greedy run, then its pieces turned. VENEER_BENCH_PATCHES
// compares only so many patches of each case.
//
// They need the developer's data set beside the sources (VENEER_DATA names another folder). Times are of processors.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>

#include "planner/global/global_plan.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/parallel.h"
#include "planner/pictures/features.h"
#include "planner/pictures/pictures.h"
#include "planner/poses/fine_rotation.h"
#include "planner/problem/problem.h"
#include "tests/bench/data_folder.h"
#include "tests/support/patch_shapes.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

constexpr int kThreads = 2;
constexpr double kDpi = 300;
constexpr double kMiss = 0.001;  // a choice that costs more than this part above the best one is a miss

// Of this process, all threads.
double cpu_seconds() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::size_t compared_patches() {
  const char* wanted = std::getenv("VENEER_BENCH_PATCHES");  // NOLINT(concurrency-mt-unsafe)
  return wanted != nullptr ? static_cast<std::size_t>(std::max(1, std::atoi(wanted))) : 1000;
}

cv::Mat noisy(const cv::Mat& picture, double sigma, std::uint64_t seed) {
  if (sigma <= 0) return picture;
  cv::Mat noise(picture.size(), CV_16SC3), out;
  cv::RNG(seed).fill(noise, cv::RNG::NORMAL, cv::Scalar::all(0), cv::Scalar::all(sigma));
  picture.convertTo(out, CV_16SC3);
  out += noise;
  out.convertTo(out, CV_8UC3);
  return out;
}

// astronaut_head from panel_small or panel_large with its mask.
struct Case {
  std::string name;
  bool large = false;
  int patches = 14;    // a side
  double pixels = 48;  // of a patch's side
  double target_noise = 0, wood_noise = 0;
};

struct Scene {
  Artwork artwork;
  StockPanel panel;
  PlanOptions options;
};

std::optional<Scene> load(const Case& it, benchmark::State& state) {
  const fs::path wood = bench::data_folder() / "wood", name = it.large ? "panel_large" : "panel_small";
  const auto target = load_picture(bench::data_folder() / "targets" / "astronaut_head.png");
  const auto picture = load_picture(wood / (name.string() + ".jpg"));
  const auto mask = load_mask(wood / (name.string() + "_mask.png"));
  if (!target.ok() || !picture.ok() || !mask.ok()) {
    state.SkipWithError("the data set is not there: VENEER_DATA names its folder");
    return std::nullopt;
  }
  Scene scene;
  const int side = static_cast<int>(std::lround(it.patches * it.pixels));
  cv::Mat enlarged;
  cv::resize(*target, enlarged, {side, side}, 0, 0, cv::INTER_LINEAR);
  const Millimetres size(side / kDpi * 25.4);
  scene.artwork = {"target", "A", it.target_noise > 0 ? noisy(enlarged, it.target_noise, 2) : *target, size, size};
  scene.panel.id = {"panel"};
  scene.panel.picture.pixels = noisy(*picture, it.wood_noise, 1);
  scene.panel.picture.resolution = scene.panel.free.resolution = ScanResolution::from_dpi(kDpi);
  scene.panel.free.pixels = *mask;
  scene.options.patch = Millimetres(it.pixels / kDpi * 25.4);
  scene.options.dpi = kDpi, scene.options.threads = kThreads;
  return scene;
}

std::optional<Problem> problem_of(const Scene& scene, benchmark::State& state) {
  Result<Problem> problem = make_problem(std::span(&scene.artwork, 1), std::span(&scene.panel, 1), scene.options);
  if (problem.ok()) return std::move(*problem);
  state.SkipWithError(problem.error().message.c_str());
  return std::nullopt;
}

std::unique_ptr<Matcher> shortlist_of(const Problem& problem, const PlanOptions& options) {
  auto matcher = std::make_unique<ShortlistMatcher>(problem.panels, turns(options.rotations), problem.classes,
                                                    largest_response(options));
  if (!matcher->build_index(kThreads, {}).ok()) std::abort();
  return matcher;
}

std::unique_ptr<Matcher> certified_of(const Problem& problem, const PlanOptions& options) {
  auto matcher = std::make_unique<CertifiedMatcher>(problem.panels, turns(options.rotations), problem.classes,
                                                    problem.entries_per_unit);
  if (!matcher->build_index(kThreads, {}).ok()) std::abort();
  return matcher;
}

struct Choices {
  std::vector<std::optional<LatticeCandidate>> found;
  double cpu = 0;  // a patch
};

Choices first_choices(const Matcher& matcher, const Problem& problem, const std::vector<std::size_t>& patches) {
  Choices out;
  out.found.resize(patches.size());
  const double before = cpu_seconds();
  (void)run_parallel(patches.size(), kThreads, {},
                     [&](std::size_t i) { out.found[i] = *matcher.best(problem.queue[patches[i]].match, {}); });
  out.cpu = (cpu_seconds() - before) / static_cast<double>(patches.size());
  return out;
}

void compare(benchmark::State& state, const Choices& shortlist,
             const std::vector<std::optional<LatticeCandidate>>& best) {
  double found_cost = 0, best_cost = 0, misses = 0, worst = 1;
  for (std::size_t i = 0; i < best.size(); ++i) {
    if (shortlist.found[i].has_value() != best[i].has_value()) {
      state.SkipWithError("one finds a candidate where the other finds none");
      return;
    }
    if (!best[i]) continue;
    found_cost += shortlist.found[i]->cost, best_cost += best[i]->cost;
    worst = std::max(worst, shortlist.found[i]->cost / best[i]->cost);
    misses += shortlist.found[i]->cost > best[i]->cost * (1 + kMiss) ? 1 : 0;
  }
  state.counters["compared"] = static_cast<double>(best.size());
  state.counters["cost_ratio"] = found_cost / best_cost;
  state.counters["cost_ratio_worst"] = worst;
  state.counters["misses"] = misses;
  state.counters["patch_ms"] = 1e3 * shortlist.cpu;
}

void compare_with_certified(benchmark::State& state, const Problem& problem, const PlanOptions& options) {
  std::vector<std::size_t> all(problem.queue.size()), sample;
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::mt19937 random(1);
  std::sample(all.begin(), all.end(), std::back_inserter(sample), compared_patches(), random);
  const Choices shortlist = first_choices(*shortlist_of(problem, options), problem, sample);
  const Choices certified = first_choices(*certified_of(problem, options), problem, sample);
  compare(state, shortlist, certified.found);
  state.counters["certified_patch_ms"] = 1e3 * certified.cpu;
}

void noisy_choices(benchmark::State& state, const Case& it) {
  for (auto _ : state) {
    const auto scene = load(it, state);
    const auto problem = scene ? problem_of(*scene, state) : std::nullopt;
    if (!problem) return;
    compare_with_certified(state, *problem, scene->options);
  }
}

// Like a grid that was bent: each corner is drawn in by up to three tenths.
test::Shape quadrilateral(std::size_t number) {
  std::mt19937 random(static_cast<unsigned>(number));
  const auto in = [&] { return 0.3 * static_cast<double>(random()) / 4294967295.0; };
  const double a = in(), b = in(), c = in(), d = in(), e = in(), f = in(), g = in(), h = in();
  return test::stretched({{a, b}, {1 - c, d}, {1 - e, 1 - f}, {g, 1 - h}});
}

void irregular_choices(benchmark::State& state, const Case& it, const test::ShapeOf& shape_of) {
  for (auto _ : state) {
    const auto scene = load(it, state);
    auto problem = scene ? problem_of(*scene, state) : std::nullopt;
    if (!problem) return;
    if (shape_of) test::reshape(*problem, shape_of);
    compare_with_certified(state, *problem, scene->options);
  }
}

void turned_finely(benchmark::State& state, const Case& it) {
  const auto scene = load(it, state);
  const auto problem = scene ? problem_of(*scene, state) : std::nullopt;
  if (!problem) return;
  const std::unique_ptr<Matcher> matcher = shortlist_of(*problem, scene->options);
  std::vector<std::optional<LatticeCandidate>> chosen;
  const double before = cpu_seconds();
  for (const Problem::Task& task : problem->queue) {
    chosen.push_back(*matcher->best(task.match, {}));
    if (chosen.back()) matcher->take(task.match, *chosen.back());
  }
  const double filled =
      static_cast<double>(chosen.size()) - static_cast<double>(std::count(chosen.begin(), chosen.end(), std::nullopt));
  state.counters["greedy_patch_ms"] = 1e3 * (cpu_seconds() - before) / filled;
  const PatchPlacements patches = placements_of(*problem, *matcher, chosen);
  FineReport report;
  double cpu = 0;
  for (auto _ : state) {
    const double start = cpu_seconds();
    report = turn_finely(*problem, *matcher, patches, kThreads, [](double) {}, {})->report;
    cpu = cpu_seconds() - start;
  }
  state.counters["patches"] = filled;
  state.counters["moved"] = static_cast<double>(report.moved);
  state.counters["cost_before"] = report.cost_before;
  state.counters["cost"] = report.cost;
  state.counters["gain_percent"] = 100 * (1 - report.cost / report.cost_before);
  state.counters["patch_ms"] = 1e3 * cpu / filled;
}

void once(const std::string& name, const std::function<void(benchmark::State&)>& work) {
  benchmark::RegisterBenchmark(name.c_str(), work)->Iterations(1)->Unit(benchmark::kSecond);
}

const int kRegistered = [] {
  const std::vector<Case> noisy_cases{{"none"},
                                      {"target_5", false, 14, 48, 5},
                                      {"target_10", false, 14, 48, 10},
                                      {"target_20", false, 14, 48, 20},
                                      {"wood_5", false, 14, 48, 0, 5},
                                      {"wood_10", false, 14, 48, 0, 10},
                                      {"wood_20", false, 14, 48, 0, 20},
                                      {"both_10", false, 14, 48, 10, 10}};
  for (const Case& it : noisy_cases)
    once("noisy/small_48px_" + it.name + "_choices", [it](benchmark::State& state) { noisy_choices(state, it); });
  const std::vector<std::pair<std::string, test::ShapeOf>> all_shapes{
      {"square", nullptr}, {"triangle", test::triangle}, {"disc", test::disc},       {"quadrilateral", quadrilateral},
      {"ell", test::ell},  {"crescent", test::crescent}, {"meander", test::meander}, {"star", test::star}};
  for (const auto& [name, shape_of] : all_shapes) {
    once("irregular/small_48px_" + name + "_choices",
         [shape_of = shape_of](benchmark::State& state) { irregular_choices(state, {}, shape_of); });
    once("irregular/small_165px_" + name + "_choices", [shape_of = shape_of](benchmark::State& state) {
      irregular_choices(state, {"", false, 4, 165}, shape_of);
    });
  }
  const std::vector<Case> turned{{"small_48px"}, {"large_48px", true, 20}, {"small_165px", false, 4, 165}};
  for (const Case& it : turned)
    once("fine_rotation/" + it.name, [it](benchmark::State& state) { turned_finely(state, it); });
  return 0;
}();

}  // namespace
}  // namespace veneer::planner
