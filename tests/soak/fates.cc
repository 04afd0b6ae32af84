// How reconciliation does on panels of every board, wood and lid, drawn from a seed: wood cut as booked, booked and
// still there, gone and not booked, torn off. Prints a table, writes JSON, exits 1 when a figure is missed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>
#include <vector>

#include "tests/soak/campaigns.h"
#include "tests/support/wood_deeds.h"
#include "tests/support/workshop_wood.h"

namespace veneer::soak {
namespace {

void tell(int i, const workshop::FateVerdict& verdict) {
  constexpr const char* kLids[] = {"white", "grey", "black"};
  const auto where = fmt::format("{} {}, {} lid", i, verdict.board, kLids[static_cast<std::size_t>(verdict.lid)]);
  if (!verdict.refused.empty()) fmt::print("{}: refused: {}\n", where, verdict.refused);
  for (const auto& what : verdict.false_ones) fmt::print("{}: {} that is none\n", where, what);
  for (const auto& piece : verdict.pieces) {
    if (piece.found && !is_doubted(piece)) continue;
    fmt::print("{}: {}: {} at {:.1f}, {:.1f}, {:.0f} mm2{}, {:.2f} of it seen gone\n", where, name_of(piece.fate),
               piece.wood, piece.place.x.count(), piece.place.y.count(), piece.area, piece.found ? "" : ", missed",
               piece.share_gone);
  }
}

}  // namespace

int fates(int argc, char** argv) {
  CLI::App app{"Reconciles panels of every board, wood and lid with what was truly done to them", "veneer-soak fates"};
  int cases = 200, first = 0, threads = 1;
  std::uint64_t seed = 1;
  std::string out, pictures;
  bool grown = false, verbose = false;
  app.add_option("--cases", cases, "how many");
  app.add_option("--first", first, "number of the first one");
  app.add_option("--seed", seed, "draws them all");
  app.add_option("--threads", threads, "cases that are judged at once")->check(CLI::Range(1, 64));
  app.add_option("--out", out, "JSON file");
  app.add_option("--pictures", pictures, "folder for the maps of each case");
  app.add_flag("--grown", grown, "the twin's grown woods even if photographs are there");
  app.add_flag("--verbose", verbose, "tell every piece that is missed and every false difference");
  CLI11_PARSE(app, argc - 1, argv + 1);
  const auto woods = grown ? std::filesystem::path() : workshop::photographed_woods();
  if (!pictures.empty()) std::filesystem::create_directories(pictures);

  workshop::FateFigures all;
  std::atomic<int> next = first;
  std::mutex mutex;
  if (threads > 1) cv::setNumThreads(1);
  const auto judge_all = [&] {
    for (int i = next++; i < first + cases; i = next++) {
      const workshop::FateVerdict verdict = workshop::judge_fates(seed, i, woods);
      if (!pictures.empty()) {
        cv::imwrite(fmt::format("{}/{:03}-before.png", pictures, i), verdict.before);
        cv::imwrite(fmt::format("{}/{:03}-now.png", pictures, i), verdict.now);
      }
      const std::scoped_lock lock(mutex);
      all.add(verdict);
      if (verbose) tell(i, verdict);
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(judge_all);
    judge_all();
  }
  fmt::print("{}", to_table(all));
  nlohmann::json told = to_json(all);
  told["schema_version"] = 1, told["seed"] = seed;
  if (!out.empty()) std::ofstream(out) << told.dump(2) << '\n';
  return all.refused == 0 && all.false_ones == 0 && all.all_missed() == 0 ? 0 : 1;
}

}  // namespace veneer::soak
