// How many screw holes the eyes take for wood, on panels of the twin's bench and workshop. Prints a table, writes JSON,
// exits 1 when one is taken or a scan is refused.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <thread>
#include <vector>

#include "tests/soak/campaigns.h"
#include "tests/support/holed_panels.h"

namespace veneer::soak {

int holes(int argc, char** argv) {
  CLI::App app{"Masks panels of the twin and counts the screw holes that are taken for wood", "veneer-soak holes"};
  int panels = 250, first = 0, threads = 1;
  std::uint64_t seed = 1;
  std::string out;
  bool verbose = false;
  app.add_option("--panels", panels, "how many, half of them of either preset");
  app.add_option("--first", first, "number of the first one");
  app.add_option("--seed", seed, "draws them all");
  app.add_option("--threads", threads, "panels that are judged at once")->check(CLI::Range(1, 64));
  app.add_option("--out", out, "JSON file");
  app.add_flag("--verbose", verbose, "tell every panel of which a hole is taken or a strip is asked about");
  CLI11_PARSE(app, argc - 1, argv + 1);

  std::map<std::string, workshop::HoleFigures> rows;
  std::atomic<int> next = first;
  std::mutex mutex;
  if (threads > 1) cv::setNumThreads(1);
  const auto judge_all = [&] {
    for (int i = next++; i < first + panels; i = next++) {
      const std::string preset = i % 2 == 0 ? "bench" : "workshop";
      const workshop::HoledPanelVerdict verdict = workshop::judge_holes({seed, i, preset});
      const std::scoped_lock lock(mutex);
      rows[preset].add(verdict);
      if (!verdict.refused.empty()) fmt::print("{} {}: refused: {}\n", i, preset, verdict.refused);
      for (const auto& hole : verdict.taken)
        fmt::print("{} {}: a hole of {:.1f} mm in {} at {:.0f}, {:.0f}: {:.2f} of it taken\n", i, preset, hole.diameter,
                   hole.species, hole.x, hole.y, hole.taken);
      if (verbose)
        fmt::print("{} {}: {} of {} strips asked about, {:.4f} of the wood taken, {:.1f} mm2 beside\n", i, preset,
                   verdict.asked, verdict.strips, verdict.wood > 0 ? verdict.wood_taken / verdict.wood : 0,
                   verdict.beside);
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(judge_all);
    judge_all();
  }
  fmt::print("{}", workshop::hole_table_head());
  workshop::HoleFigures all;
  nlohmann::json told;
  for (const auto& [preset, row] : rows) {
    fmt::print("{}", workshop::hole_table_line(preset, row));
    all.add(row);
    told[preset] = to_json(row);
  }
  fmt::print("{}", workshop::hole_table_line("all", all));
  told["schema_version"] = 1, told["seed"] = seed, told["all"] = to_json(all);
  if (!out.empty()) std::ofstream(out) << told.dump(2) << '\n';
  // A mask that takes nothing takes no hole either.
  const bool takes_wood = all.wood_taken > 0.985 * all.wood;
  return all.refused == 0 && all.in_part == 0 && all.beside == 0 && takes_wood ? 0 : 1;
}

}  // namespace veneer::soak
