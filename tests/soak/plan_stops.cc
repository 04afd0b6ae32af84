// How long planning goes on after a stop request: from the request to the return of make_plan, on the clock and in
// processor time of all threads, at random moments of a plan on a large panel. Memory that planning frees is kept for
// the next run, because giving gigabytes back to the system takes longer than all the rest; --give-back measures that.
#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <thread>
#include <tuple>

#include "planner/files/plan_journal.h"
#include "planner/pictures/pictures.h"
#include "planner/plan.h"
#include "tests/soak/campaigns.h"
#include "tests/soak/percentile.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::soak {
namespace {

using namespace planner;
using tests::percentile;

double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// Boards side by side on a background that is no wood, mirrored where their pictures meet.
StockPanel tiled_panel(cv::Size size, double dpi) {
  const cv::Mat wood = test::wood_picture(1400, 1100, 1);
  StockPanel panel;
  panel.id = {"P"};
  panel.picture.pixels = cv::Mat(size, CV_8UC3, cv::Scalar::all(230));
  panel.picture.resolution = panel.free.resolution = ScanResolution::from_dpi(dpi);
  panel.free.pixels = cv::Mat(size, CV_8UC1, cv::Scalar(0));
  const cv::Rect all({0, 0}, size);
  for (int left = 8, column = 0; left < size.width; left += wood.cols + 8, ++column) {
    for (int top = 0, row = 0; top < size.height; top += wood.rows, ++row) {
      cv::Mat tile = wood;
      if (row % 2 == 1) cv::flip(wood, tile, 0);
      const cv::Rect place = cv::Rect(left, top, tile.cols, tile.rows) & all;
      tile(cv::Rect({0, 0}, place.size())).copyTo(panel.picture.pixels(place));
    }
    panel.free.pixels(cv::Rect(left + 8, 8, wood.cols - 16, size.height - 16) & all).setTo(255);
  }
  return panel;
}

double decoding_ms(const cv::Mat& picture, const std::string& extension) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, picture, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
  const auto start = std::chrono::steady_clock::now();
  const auto read =
      decode_picture({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "the panel" + extension);
  return read.ok() ? ms_since(start) : 0;
}

struct Stopped {
  double ms = 0, cpu_ms = 0;
  bool in_time = false;  // the plan was not made before
  std::string doing;     // what was last reported
};

Stopped stop_after(std::chrono::duration<double> moment, const Artwork& artwork, const StockPanel& panel,
                   const PlanOptions& options, const std::filesystem::path& folder) {
  std::stop_source stop;
  Stopped out;
  std::promise<void> over;
  std::filesystem::remove(folder / "plan.journal");
  Result<PlanJournal> journal = PlanJournal::open(folder / "plan.journal", "soak");
  if (!journal.ok()) return out;
  std::thread planner([&] {
    const auto plan = make_plan(
        std::span(&artwork, 1), std::span(&panel, 1), options,
        [&](double, std::string_view text) { out.doing = text.substr(0, text.find(':')); }, stop.get_token(), &*journal,
        nullptr, OnStop::kBestSoFar);
    out.in_time = !plan.ok() || (plan->global && plan->global->stopped);
    over.set_value();
  });
  const auto done = over.get_future();
  const bool early = done.wait_for(moment) == std::future_status::ready;
  const auto asked = std::chrono::steady_clock::now();
  const std::clock_t asked_cpu = std::clock();
  stop.request_stop();
  done.wait();
  out.ms = ms_since(asked);
  out.cpu_ms = 1000.0 * static_cast<double>(std::clock() - asked_cpu) / CLOCKS_PER_SEC;
  out.in_time = out.in_time && !early;
  planner.join();
  return out;
}

}  // namespace

int plan_stops(int argc, char** argv) {
  CLI::App app{"A stop request, until planning has ended", "veneer-soak plan-stops"};
  int stops = 100, width = 3000, height = 2400, patches = 20;
  std::uint64_t seed = 1;
  double limit_ms = 100;
  bool together = false, give_back = false;
  std::string out;
  PlanOptions options;
  options.patch = Millimetres(48 / 300.0 * 25.4);
  app.add_option("--stops", stops, "How many before the index stands, and how many afterwards")->capture_default_str();
  app.add_option("--width-px", width, "Of the panel, at 300 dpi")->capture_default_str();
  app.add_option("--height-px", height)->capture_default_str();
  app.add_option("--patches", patches, "Along each side of the picture, of 48 pixels")->capture_default_str();
  app.add_option("--seed", seed, "Of the moments")->capture_default_str();
  app.add_option("--limit-ms", limit_ms, "For the 99th percentile of each")->capture_default_str();
  app.add_flag("--give-back", give_back, "Let memory go back to the system in the time that is measured");
  app.add_flag("--exact", options.exact, "With the certified search");
  app.add_flag("--together", together, "Patches choose together, and only then are stops requested");
  app.add_option("--index-cache", options.index_cache, "As veneerctl plan has it");
  app.add_option("--out", out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc - 1, argv + 1);
  if (!give_back) {
    // NOLINTBEGIN(concurrency-mt-unsafe): there is no other thread yet
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_ARENA_MAX, 1);
    // NOLINTEND(concurrency-mt-unsafe)
  }

  if (together) options.optimize = Optimize::kGlobal;
  const veneer::testing::TempDirectory folder;
  const StockPanel panel = tiled_panel({width, height}, 300);
  const Artwork artwork = test::blob_artwork("A", 300, 300, patches * options.patch, 2);
  fmt::print("decoding the panel, which nothing interrupts: {:.0f} ms as PNG, {:.0f} ms as JPEG\n",
             decoding_ms(panel.picture.pixels, ".png"), decoding_ms(panel.picture.pixels, ".jpg"));
  const auto start = std::chrono::steady_clock::now();
  const auto whole = make_plan(std::span(&artwork, 1), std::span(&panel, 1), options);
  const double whole_s = ms_since(start) / 1000;
  if (!whole.ok()) {
    fmt::print(stderr, "{}\n", whole.error().message);
    return 1;
  }
  const double index_s = whole->seconds.features;
  fmt::print("{} x {} pixels: the index takes {:.1f} s, the whole plan {:.1f} s\n", width, height, index_s, whole_s);
  std::mt19937_64 random(seed);
  nlohmann::json rows = nlohmann::json::array();
  bool soon = true;
  std::vector<std::tuple<std::string, double, double>> parts{{"before the index stands", 0.0, index_s},
                                                             {"while patches choose", index_s, whole_s}};
  if (together) parts = {{"while they choose together", whole_s - whole->global->seconds, whole_s}};
  for (const auto& [name, from, to] : parts) {
    std::vector<double> values, cpu;
    Stopped slowest;
    for (int i = 0; i < stops; ++i) {
      const double moment = std::uniform_real_distribution(from, to)(random);
      const Stopped stopped = stop_after(std::chrono::duration<double>(moment), artwork, panel, options, folder.path());
      if (!stopped.in_time) continue;
      values.push_back(stopped.ms), cpu.push_back(stopped.cpu_ms);
      if (stopped.ms > slowest.ms) slowest = stopped;
    }
    fmt::print(
        "{:<26} {:>4} stops  p50 {:7.2f} ms  p99 {:7.2f} ms  max {:7.2f} ms (\"{}\"); of the processor p50 {:.2f} ms  "
        "max {:.2f} ms\n",
        name, values.size(), percentile(values, 0.5), percentile(values, 0.99), percentile(values, 1), slowest.doing,
        percentile(cpu, 0.5), percentile(cpu, 1));
    std::fflush(stdout);
    soon = soon && percentile(values, 0.99) <= limit_ms;
    rows.push_back({{"when", name},
                    {"stops", values.size()},
                    {"p50_ms", percentile(values, 0.5)},
                    {"p99_ms", percentile(values, 0.99)},
                    {"max_ms", percentile(values, 1)},
                    {"samples_ms", values},
                    {"samples_cpu_ms", cpu}});
  }
  if (!out.empty()) std::ofstream(out) << nlohmann::json{{"schema_version", 1}, {"stops", rows}}.dump(2);
  return soon ? 0 : 1;
}

}  // namespace veneer::soak
