// How much of a picture each layout keeps: six pictures and the case by which layouts are compared, planned by the
// command as users run it. Not among the benchmarks that run unasked, because it takes an hour of processors:
// './dev bench layouts', or one of them, './dev bench layouts/astronaut/'.
//
// './dev bench layouts/table/' takes some minutes: each layout once over, on one picture and the small panel, three
// times each in turns, and prints the table of docs/PLANNER.md ("What a layout costs").
//
// preview_cost is report.json's preview_cost_per_pixel, ratio that to the plain grid's of the same run. The others
// compare the grey of preview.png with that of the picture itself, before its tones are mapped to the wood's:
// correlation and rmse (of tones from 0 to 1) between the means of blocks of 12 x 12 pixels, psnr_db between pixels.
// Pictures come from the developer's data set beside the sources (VENEER_DATA names another folder).
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "tests/bench/data_folder.h"
#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

constexpr int kBlock = 12;  // pixels

struct Layout {
  const char* name;
  std::vector<std::string> options;
};
const std::vector<Layout> kLayouts{
    {"grid", {}},
    {"dp", {"--refine", "dp"}},
    {"dp_rematched", {"--refine", "dp", "--rematch", "4"}},
    {"morph", {"--layout", "morph"}},
    {"morph_dp", {"--layout", "morph", "--refine", "dp"}},
    {"mosaic", {"--layout", "mosaic"}},
};
// Of the case by which layouts are compared.
const std::vector<Layout> kChoices{
    {"grid", {}},
    {"global", {"--optimize", "global"}},
    {"dp", {"--refine", "dp"}},
    {"dp_global", {"--refine", "dp", "--optimize", "global"}},
    {"dp_rematched_global", {"--refine", "dp", "--optimize", "global", "--rematch", "4"}},
};

// One layout after the other, as a person would choose among them.
const std::vector<Layout> kOfTheTable{
    {"grid", {}},
    {"adaptive", {"--adaptive-levels", "1"}},
    {"dp", {"--refine", "dp"}},
    {"morph", {"--layout", "morph"}},
    {"mosaic", {"--layout", "mosaic"}},
    {"segmentation", {"--layout", "segmentation"}},
};

struct Case {
  std::string picture;  // in targets/
  std::vector<std::string> options;
};

double cpu_seconds_of_children() {
  struct rusage usage {};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Of the last minute: how much else the machine had to do.
double load_average() {
  double load = 0;
  return ::getloadavg(&load, 1) == 1 ? load : 0;
}

// From 0 to 1, CV_64FC1.
cv::Mat grey(const cv::Mat& bgr) {
  cv::Mat out;
  cv::cvtColor(bgr, out, cv::COLOR_BGR2GRAY);
  out.convertTo(out, CV_64FC1, 1 / 255.0);
  return out;
}

// What is left over at the right and below does not count.
cv::Mat block_means(const cv::Mat& picture) {
  const cv::Size blocks(picture.cols / kBlock, picture.rows / kBlock);
  cv::Mat out;
  cv::resize(picture(cv::Rect({0, 0}, blocks * kBlock)), out, blocks, 0, 0, cv::INTER_AREA);
  return out;
}

struct Likeness {
  double correlation, rmse, psnr_db;
};

Likeness likeness(const cv::Mat& preview, const cv::Mat& picture) {
  cv::Mat target;
  const bool shrinks = preview.total() < picture.total();
  cv::resize(picture, target, preview.size(), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_CUBIC);
  const cv::Mat shown = grey(preview), wanted = grey(target), a = block_means(shown), b = block_means(wanted);
  cv::Scalar mean_a, mean_b, spread_a, spread_b;
  cv::meanStdDev(a, mean_a, spread_a), cv::meanStdDev(b, mean_b, spread_b);
  const double together = cv::mean((a - mean_a[0]).mul(b - mean_b[0]))[0];
  const auto mean_square = [](const cv::Mat& d) { return cv::mean(d.mul(d))[0]; };
  return {together / std::max(1e-12, spread_a[0] * spread_b[0]), std::sqrt(mean_square(a - b)),
          -10 * std::log10(std::max(1e-12, mean_square(shown - wanted)))};
}

// What planning by these words came to.
struct Planned {
  nlohmann::json report;
  double cpu_s = 0, clock_s = 0;
};

// Rows of the table in the order of kOfTheTable, once all have been planned as often.
void print_table(const std::map<std::string, std::vector<Planned>>& runs, double load) {
  const auto now = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
  const std::chrono::year_month_day day(now);
  fmt::print("{}-{:02}-{:02}, load average {:.0f} before and {:.0f} after, {} runs each\n\n",
             static_cast<int>(day.year()), static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()), load,
             load_average(), runs.at(kOfTheTable[0].name).size());
  fmt::print(
      "| | pieces | unfilled | `preview_cost_per_pixel` | processor time, least to most | by the clock, least |\n");
  fmt::print("|---|---|---|---|---|---|\n");
  for (const Layout& layout : kOfTheTable) {
    const std::vector<Planned>& all = runs.at(layout.name);
    const nlohmann::json& report = all[0].report;
    const auto [least, most] = std::ranges::minmax(all, {}, &Planned::cpu_s);
    fmt::print("| {} | {} | {} | {:.5f} | {:.1f} to {:.1f} s | {:.1f} s |\n", layout.name,
               report.at("pieces").get<int>(), report.at("unfilled").get<int>(),
               report.at("preview_cost_per_pixel").get<double>(), least.cpu_s, most.cpu_s,
               std::ranges::min(all, {}, &Planned::clock_s).clock_s);
  }
  std::fflush(stdout);
}

// In turns, so that what else the machine does is spread over all layouts alike.
void table(benchmark::State& state) {
  constexpr int kRuns = 3;
  const fs::path data = bench::data_folder(), picture = data / "targets" / "astronaut_head.png";
  if (!fs::exists(picture)) {
    state.SkipWithError(
        fmt::format("{} is not there: name the data set's folder in VENEER_DATA", picture.string()).c_str());
    return;
  }
  const std::string wood = (data / "wood" / "panel_small").string();
  const double load = load_average();
  std::map<std::string, std::vector<Planned>> runs;
  for ([[maybe_unused]] const auto& once : state) {
    for (int i = 0; i < kRuns; ++i)
      for (const Layout& layout : kOfTheTable) {
        const testing::TempDirectory out;
        std::vector<std::string> words{VENEERCTL,    "plan",
                                       "--target",   picture.string(),
                                       "--panel",    fmt::format("{0}.jpg,mask={0}_mask.png", wood),
                                       "--size-mm",  "56.9",
                                       "--dpi",      "300",
                                       "--patch-mm", "4.064",
                                       "--format",   "json",
                                       "--out",      out.path().string()};
        words.insert(words.end(), layout.options.begin(), layout.options.end());
        const double before = cpu_seconds_of_children();
        const auto began = std::chrono::steady_clock::now();
        const tests::Finished finished = tests::run_program(words);
        if (finished.status != 0) {
          state.SkipWithError(finished.output.c_str());
          return;
        }
        std::ifstream in(out.path() / "report.json");
        runs[layout.name].push_back({nlohmann::json::parse(in), cpu_seconds_of_children() - before,
                                     std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count()});
      }
  }
  for (const auto& [name, all] : runs) {
    state.counters[name + "_cost"] = all[0].report.at("preview_cost_per_pixel").get<double>();
    state.counters[name + "_cpu_s"] = std::ranges::min(all, {}, &Planned::cpu_s).cpu_s;
  }
  print_table(runs, load);
}
BENCHMARK(table)->Name("layouts/table/")->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);

void plan(benchmark::State& state, const std::string& group, const Case& it, const Layout& layout) {
  static std::map<std::string, double> grids;  // preview_cost of each
  const fs::path data = bench::data_folder(), picture = data / "targets" / it.picture;
  if (!fs::exists(picture)) {
    state.SkipWithError(
        fmt::format("{} is not there: name the data set's folder in VENEER_DATA", picture.string()).c_str());
    return;
  }
  const testing::TempDirectory out;
  std::vector<std::string> words{VENEERCTL,  "plan", "--target", picture.string(),
                                 "--format", "json", "--out",    out.path().string()};
  for (std::string word : it.options) {
    for (std::size_t at = word.find("WOOD/"); at != std::string::npos; at = word.find("WOOD/"))
      word.replace(at, 4, (data / "wood").string());
    words.push_back(word);
  }
  words.insert(words.end(), layout.options.begin(), layout.options.end());
  for ([[maybe_unused]] const auto& once : state) {
    const double before = cpu_seconds_of_children();
    const tests::Finished finished = tests::run_program(words);
    if (finished.status != 0) {
      state.SkipWithError(finished.output.c_str());
      return;
    }
    state.counters["cpu_s"] = cpu_seconds_of_children() - before;
    std::ifstream in(out.path() / "report.json");
    const auto report = nlohmann::json::parse(in);
    const double cost = report.at("preview_cost_per_pixel").get<double>();
    if (layout.options.empty()) grids[group] = cost;
    state.counters["pieces"] = report.at("pieces").get<double>();
    state.counters["unfilled"] = report.at("unfilled").get<double>();
    state.counters["preview_cost"] = cost;
    if (grids.contains(group)) state.counters["ratio"] = cost / grids[group];
    if (const auto& mosaic = report.at("mosaic"); mosaic.is_object())
      state.counters["cell_deviation_deg"] = mosaic.at("cell_deviation_deg").get<double>();
    const Likeness like = likeness(cv::imread((out.path() / "preview.png").string()), cv::imread(picture.string()));
    state.counters["correlation"] = like.correlation;
    state.counters["rmse"] = like.rmse;
    state.counters["psnr_db"] = like.psnr_db;
  }
}

void add(const std::string& group, const Case& it, const std::vector<Layout>& layouts) {
  for (const Layout& layout : layouts)
    benchmark::RegisterBenchmark(fmt::format("layouts/{}/{}", group, layout.name).c_str(),
                                 [=](benchmark::State& state) { plan(state, group, it, layout); })
        ->Iterations(1)
        ->UseRealTime()
        ->Unit(benchmark::kSecond);
}

const bool kAdded = [] {
  for (const char* picture :
       {"astronaut.png", "chelsea.png", "coffee.png", "grace_hopper.jpg", "parrots.png", "statue.png"})
    add(fs::path(picture).stem().string(),
        {picture,
         {"--panel", "WOOD/panel_large.jpg,mask=WOOD/panel_large_mask.png,dpi=96", "--size-mm", "360", "--dpi", "96",
          "--patch-mm", "14"}},
        kLayouts);
  for (const char* patch : {"4.064", "3.048"})
    add(fmt::format("head_{}", patch),
        {"astronaut_head.png",
         {"--panel", "WOOD/panel_small.jpg,mask=WOOD/panel_small_mask.png", "--size-mm", "56.9", "--dpi", "300",
          "--patch-mm", patch}},
        kChoices);
  return true;
}();

}  // namespace
}  // namespace veneer::planner
