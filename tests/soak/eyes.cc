// How the eyes do on panels of every board and wood, drawn from a seed: the mask strip by strip, screws and cracks
// within it, sheets entered with a wrong outline. Prints a table, writes JSON, exits 1 when a figure is missed.
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
#include "tests/support/mask_figures.h"
#include "tests/support/workshop_wood.h"

namespace veneer::soak {
namespace {

// The data set's composed scans, held against their own masks: precision and recall, 0.99 each. False when one fails.
bool judge_pictures(const std::filesystem::path& woods, nlohmann::json& told) {
  bool good = true;
  for (const char* name : {"panel_small", "panel_large"}) {
    const cv::Mat picture = cv::imread((woods / fmt::format("{}.jpg", name)).string()),
                  usable = cv::imread((woods / fmt::format("{}_mask.png", name)).string(), cv::IMREAD_GRAYSCALE);
    if (picture.empty() || usable.size() != picture.size()) continue;
    const auto verdict = workshop::judge_picture(picture, ScanResolution::from_dpi(300), usable);
    fmt::print("{}: precision {:.4f}, recall {:.4f}{}\n", name, verdict.precision, verdict.recall,
               verdict.refused.empty() ? "" : ", refused: " + verdict.refused);
    for (const auto& why : verdict.asked) fmt::print("{}: a strip is asked about: {}\n", name, why);
    told["pictures"][name] = {{"precision", verdict.precision}, {"recall", verdict.recall}};
    good = good && verdict.precision >= 0.99 && verdict.recall >= 0.99;
  }
  return good;
}

// Tells every strip and fault that is missed, and counts strips by wood.
void tell(int i, const workshop::PanelVerdict& verdict, double dpi, std::map<std::string, int>& missed_woods) {
  if (!verdict.refused.empty()) fmt::print("{} {}: refused: {}\n", i, verdict.board, verdict.refused);
  if (verdict.outline_error > workshop::kOutline)
    fmt::print("{} {}: outline off by {:.2f} mm\n", i, verdict.board, verdict.outline_error);
  for (std::size_t k = 0; k < verdict.strips.size(); ++k) {
    const auto& strip = verdict.strips[k];
    if (holds(strip)) continue;
    fmt::print("{} {} at {:.0f} dpi: strip {} of {}: precision {:.4f}, recall {:.4f}{}\n", i, verdict.board, dpi, k + 1,
               strip.wood, strip.precision, strip.recall, strip.asked ? ", asked about" : "");
    ++missed_woods[strip.wood];
  }
  for (const auto& [fault, taken] : verdict.faults)
    if (taken > 0.02 &&
        (fault.matter != workshop::Matter::kCrack || (fault.size >= workshop::kWideCrack && taken > 0.5)))
      fmt::print("{} {}: {} of {:.2f} mm on {} at {:.0f}, {:.0f}: {:.2f} of it in the mask\n", i, verdict.board,
                 fault.kind, fault.size, verdict.strips[static_cast<std::size_t>(fault.strip - 1)].wood, fault.centre.x,
                 fault.centre.y, taken);
  if (verdict.hair > 0)
    fmt::print("{} {}: {:.2f} of the hairs over wood in the mask, {} told\n", i, verdict.board,
               verdict.hair_in_mask / verdict.hair, verdict.hairs_told);
  else if (verdict.hairs_told > 0)
    fmt::print("{} {}: a hair is told of that is not there\n", i, verdict.board);
}

}  // namespace

int eyes(int argc, char** argv) {
  CLI::App app{"Masks panels of every board and wood and holds them against the truth", "veneer-soak eyes"};
  int panels = 200, first = 0, threads = 1, hairs = 2;
  std::uint64_t seed = 1;
  std::string out, pictures;
  bool grown = false, verbose = false;
  app.add_option("--panels", panels, "how many");
  app.add_option("--first", first, "number of the first one");
  app.add_option("--seed", seed, "draws them all");
  app.add_option("--threads", threads, "panels that are judged at once")->check(CLI::Range(1, 64));
  app.add_option("--hairs", hairs, "that lie on the glass under each fifth panel");
  app.add_option("--out", out, "JSON file");
  app.add_option("--pictures", pictures, "folder for maps with their masks");
  app.add_flag("--grown", grown, "the twin's grown woods even if photographs are there");
  app.add_flag("--verbose", verbose, "tell every strip and fault that is missed");
  CLI11_PARSE(app, argc - 1, argv + 1);
  const auto woods = grown ? std::filesystem::path() : workshop::photographed_woods();
  if (!pictures.empty()) std::filesystem::create_directories(pictures);

  std::map<std::string, workshop::MaskFigures> rows;
  std::map<std::string, int> missed_woods;
  std::atomic<int> next = first;
  std::mutex mutex;
  if (threads > 1) cv::setNumThreads(1);
  const auto judge_all = [&] {
    for (int i = next++; i < first + panels; i = next++) {
      workshop::Order order = workshop::campaign_order(seed, i, woods);
      if (i % 5 == 4) order.hairs = hairs;
      const workshop::PanelVerdict verdict = workshop::judge(workshop::compose(order));
      if (!pictures.empty() && !verdict.map.empty())
        cv::imwrite(fmt::format("{}/{:03}.png", pictures, i), overlay(verdict));
      const std::scoped_lock lock(mutex);
      rows[verdict.board].add(verdict);
      if (verbose) tell(i, verdict, order.dpi, missed_woods);
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(judge_all);
    judge_all();
  }
  fmt::print("{}", workshop::table_head());
  workshop::MaskFigures all;
  nlohmann::json told;
  for (const auto& [name, row] : rows) {
    fmt::print("{}", table_line(name, row));
    all.add(row);
    told["boards"][name] = to_json(row);
  }
  fmt::print("{}", table_line("all", all));
  for (const auto& [name, count] : missed_woods) fmt::print("missed: {} x {}\n", count, name);
  const bool pictures_hold = woods.empty() || judge_pictures(woods, told);
  told["schema_version"] = 1, told["seed"] = seed, told["all"] = to_json(all);
  if (!out.empty()) std::ofstream(out) << told.dump(2) << '\n';
  const bool good = pictures_hold && all.refused == 0 && all.failed == 0 && all.wrong_outline == 0 &&
                    all.round_in_mask == 0 && all.cracks_in_mask <= 0.05 * all.cracks &&
                    all.asked <= 0.05 * all.strips && all.false_warnings + all.false_hairs <= 0.01 * all.panels;
  return good ? 0 : 1;
}

}  // namespace veneer::soak
