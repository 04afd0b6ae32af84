// How long the beam stays on after the daemon is killed in the midst of a burn: the whole simulated cell in real time,
// on both families of lasers. Judged by the twin, which knows whether the beam is on.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "tests/soak/campaigns.h"
#include "tests/support/guarded_record.h"
#include "tests/support/simulated_cell.h"

namespace veneer::soak {
namespace {

using namespace tests;
namespace fs = std::filesystem;
using nlohmann::json;

bool beam_on(const SimulatedCell& cell) {
  const auto status = cell.twin({{"cmd", "status"}});
  return status && (*status)["laser"].value("beam", false);
}

// Kills it in a burn; the milliseconds after which the beam was last seen on, < 0 when it could not be done.
double one_kill(SimulatedCell& cell, std::mt19937& random) {
  const auto ready = [&](const char* state) {
    return cell.wait_status([&](const json& s) { return s["state"] == state; }, std::chrono::seconds(120)).ok();
  };
  if (cell.api().get("/status")->value("state", "") == "Aborted" && !cell.api().post("/commands/clear").ok()) return -1;
  if (!cell.api().post("/commands/reset").ok() || !ready("Idle")) return -1;
  if (!cell.api().post("/laser/test-pattern", {{"size_mm", 200}}).ok()) return -1;
  std::this_thread::sleep_for(std::chrono::milliseconds(500 + random() % 4000));  // anywhere in the burn
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!beam_on(cell))
    if (std::chrono::steady_clock::now() > patience) return -1;
  const auto killed = std::chrono::steady_clock::now();
  cell.kill_daemon();
  double last_ms = 0;
  while (std::chrono::steady_clock::now() - killed < std::chrono::milliseconds(2500))
    if (beam_on(cell))
      last_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - killed).count();
  if (!darkened(cell.data_dir())) return -1;  // the guardian does not know that it is dark
  return cell.start_daemon() ? last_ms : -1;
}

}  // namespace

int guardian_kills(int argc, char** argv) {
  CLI::App app{"SIGKILL in a burn, until the beam is off", "veneer-soak guardian-kills"};
  int kills = 20;
  unsigned seed = 7;
  std::string out, dir = "out/soak-guardian";
  app.add_option("--kills", kills, "How many on each family")->capture_default_str();
  app.add_option("--seed", seed, "Of the moments")->capture_default_str();
  app.add_option("--dir", dir, "Where the cells live")->capture_default_str();
  app.add_option("--out", out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc - 1, argv + 1);
  const fs::path bin_dir = fs::read_symlink("/proc/self/exe").parent_path();
  bool good = true;
  json rows = json::array();
  for (const bool lihuiyu : {false, true}) {
    const std::string family = lihuiyu ? "lihuiyu" : "grbl";
    auto cell = SimulatedCell::start({.dir = fs::path(dir) / family,
                                      .bin_dir = bin_dir,
                                      .seed = 1,
                                      .time_scale = 1,
                                      .twin_tables = {},
                                      .lihuiyu = lihuiyu});
    if (!cell) {
      fmt::print(stderr, "{}\n", cell.error().message);
      return 1;
    }
    std::mt19937 random(seed);
    std::vector<double> ms;
    int failed = 0;
    for (int i = 0; i < kills; ++i) {
      const double one = one_kill(**cell, random);
      fmt::print(stderr, "{} {} of {}: {:.0f} ms\n", family, i + 1, kills, one);
      if (one < 0)
        ++failed;
      else
        ms.push_back(one);
    }
    std::sort(ms.begin(), ms.end());
    const double most = ms.empty() ? 0 : ms.back(), median = ms.empty() ? 0 : ms[ms.size() / 2];
    fmt::print("{:<8} {:>3} kills  beam last seen on: median {:5.0f} ms, most {:5.0f} ms; {} failed\n", family,
               ms.size(), median, most, failed);
    rows.push_back(
        {{"family", family}, {"kills", ms.size()}, {"median_ms", median}, {"most_ms", most}, {"samples_ms", ms}});
    good = good && failed == 0 && most <= 1000;
  }
  if (!out.empty()) std::ofstream(out) << json{{"schema_version", 1}, {"kills", rows}}.dump(2);
  return good ? 0 : 1;
}

}  // namespace veneer::soak
