// How long a STOP takes from the request to the reset byte on the wire: the real daemon streams a job to a controller
// in real time while planners keep every core busy. Any client, nobody logged in.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "tests/support/laser_only_cell.h"
#include "tests/support/temp_directory.h"

namespace {

using namespace veneer;
using namespace veneer::tests;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Planners without an end: each runs again when it is done.
class Planners {
 public:
  Planners(const fs::path& bin_dir, const fs::path& dir) {
    cv::Mat wood(1200, 1200, CV_8UC3);
    cv::randu(wood, 0, 255);
    cv::GaussianBlur(wood, wood, {0, 0}, 6);
    cv::normalize(wood, wood, 0, 255, cv::NORM_MINMAX);
    cv::imwrite((dir / "wood.png").string(), wood);
    cv::imwrite((dir / "target.png").string(), wood(cv::Rect(100, 100, 500, 500)));
    worker_ = std::thread([this, bin_dir, dir] {
      while (!ending_) {
        auto planner =
            ChildProcess::start({(bin_dir / "veneerctl").string(), "plan", "--target", (dir / "target.png").string(),
                                 "--panel", (dir / "wood.png").string() + ",dpi=200", "--size-mm", "60", "--patch-mm",
                                 "6", "--dpi", "200", "--out", (dir / "plan").string()},
                                dir / "plan.log");
        if (!planner) return;
        while (!ending_ && planner->running()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        ++runs_;
      }
    });
  }
  ~Planners() {
    ending_ = true;
    worker_.join();
  }
  int runs() const { return runs_; }

 private:
  std::atomic<bool> ending_{false};
  std::atomic<int> runs_{0};
  std::thread worker_;
};

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(p * static_cast<double>(values.size())))];
}

// Burns until the beam is on, says STOP, gives the milliseconds until the byte was there; < 0 when something failed.
double one_stop(LaserOnlyCell& cell, bool by_command) {
  if (!cell.begin_pattern(300)) return -1;
  if (!cell.wait_for([&] { return cell.laser.beam_on(); })) return -1;
  std::this_thread::sleep_for(std::chrono::milliseconds(50 + rand() % 400));  // anywhere in the stream
  const std::size_t before = cell.laser.resets().size();
  const auto asked = Clock::now();
  if (by_command ? cell.veneerctl({"stop"}).status != 0 : !cell.api().post("/stop").ok()) return -1;
  if (!cell.wait_for([&] { return cell.laser.resets().size() > before && cell.state() == "Aborted"; })) return -1;
  const double ms = std::chrono::duration<double, std::milli>(cell.laser.resets()[before] - asked).count();
  return cell.api().post("/commands/clear").ok() ? ms : -1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"STOP, from the request to the byte on the wire", "veneer-soak-stop"};
  int stops = 200, commands = 200;
  double limit_ms = 50;
  std::string out;
  app.add_option("--stops", stops, "How many by the API")->capture_default_str();
  app.add_option("--commands", commands, "How many by veneerctl, each a process of its own")->capture_default_str();
  app.add_option("--limit-ms", limit_ms, "For the 99th percentile of each")->capture_default_str();
  app.add_option("--out", out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc, argv);

  const fs::path bin_dir = fs::read_symlink("/proc/self/exe").parent_path();
  auto cell = LaserOnlyCell::start(bin_dir);
  if (!cell) {
    fmt::print(stderr, "{}\n", cell.error().message);
    return 1;
  }
  const veneer::testing::TempDirectory dir(veneer::testing::TempDirectory::Place::kDisk);
  std::vector<double> by_api, by_command;
  int planned = 0, failed = 0;
  {
    Planners planners(bin_dir, dir.path());
    // By turns, so that both meet the same load.
    for (int i = 0, j = 0; i + j < stops + commands;) {
      const bool command = i * commands > j * stops || i == stops;
      ++(command ? j : i);
      const double ms = one_stop(**cell, command);
      if (ms < 0)
        ++failed;
      else
        (command ? by_command : by_api).push_back(ms);
      fmt::print(stderr, "{} of {}: {} {:.1f} ms\n", i + j, stops + commands, command ? "veneerctl stop" : "POST /stop",
                 ms);
    }
    planned = planners.runs();
  }
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& [name, values] : {std::pair("POST /stop", by_api), std::pair("veneerctl stop", by_command)}) {
    fmt::print("{:<16} {:>4} stops  p50 {:7.2f} ms  p99 {:7.2f} ms  max {:7.2f} ms\n", name, values.size(),
               percentile(values, 0.5), percentile(values, 0.99), percentile(values, 1));
    rows.push_back({{"by", name},
                    {"stops", values.size()},
                    {"p50_ms", percentile(values, 0.5)},
                    {"p99_ms", percentile(values, 0.99)},
                    {"max_ms", percentile(values, 1)},
                    {"samples_ms", values}});
  }
  fmt::print("{} plans were made meanwhile, {} stops failed\n", planned, failed);
  if (!out.empty()) std::ofstream(out) << nlohmann::json{{"schema_version", 1}, {"stops", rows}}.dump(2);
  const bool fast = percentile(by_api, 0.99) <= limit_ms && percentile(by_command, 0.99) <= limit_ms;
  return failed == 0 && fast ? 0 : 1;
}
