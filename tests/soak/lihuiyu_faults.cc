// The whole fault campaign of the Lihuiyu driver as a table: kinds of faults by seeds, how the jobs ended, and what
// must never happen. Exits 1 when it did.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/lihuiyu_campaign.h"

int main(int argc, char** argv) {
  using namespace veneer::tests;
  CLI::App app{"Faults on a Lihuiyu board and its USB link", "veneer-soak-lihuiyu"};
  int runs = 500;
  std::uint64_t seed = 1;
  std::string out;
  app.add_option("--runs", runs, "Runs of each kind")->capture_default_str();
  app.add_option("--seed", seed, "The first run's seed")->capture_default_str();
  app.add_option("--out", out, "Also write the table as JSON");
  CLI11_PARSE(app, argc, argv);

  nlohmann::json rows = nlohmann::json::array();
  bool clean = true;
  std::vector<std::string> complaints;
  fmt::print("{:<18}{:>6}{:>10}{:>9}{:>9}{:>14}{:>11} |{:>7}{:>8}{:>11}{:>12}{:>9}\n", "fault", "runs", "complete",
             "aborted", "suspect", "software-off", "relay-off", "wrong", "broken", "moved, mm", "Hausd., mm",
             "queue, s");
  for (const std::string_view kind : kBoardFaults) {
    const BoardRow row = run_board_campaign(kind, runs, seed);
    fmt::print("{:<18}{:>6}{:>10}{:>9}{:>9}{:>14}{:>11} |{:>7}{:>8}{:>11.3f}{:>12.4f}{:>9.3f}\n", row.kind, row.runs,
               row.complete, row.aborted, row.suspect, row.software_off, row.relay_off, row.wrong, row.broken,
               row.without_consent_mm, row.hausdorff_mm, row.longest_queue_s);
    clean = clean && row.clean();
    complaints.insert(complaints.end(), row.complaints.begin(), row.complaints.end());
    rows.push_back({{"fault", row.kind},
                    {"runs", row.runs},
                    {"complete", row.complete},
                    {"aborted", row.aborted},
                    {"suspect", row.suspect},
                    {"beam_off_by_software", row.software_off},
                    {"beam_off_by_relay_only", row.relay_off},
                    {"wrong_unreported", row.wrong},
                    {"promises_broken", row.broken},
                    {"moved_without_consent_mm", row.without_consent_mm},
                    {"hausdorff_mm", row.hausdorff_mm},
                    {"longest_queue_s", row.longest_queue_s}});
  }
  for (std::size_t i = 0; i < complaints.size() && i < 40; ++i) fmt::print("{}\n", complaints[i]);
  if (!out.empty())
    std::ofstream(out) << nlohmann::json{{"schema_version", 1}, {"seed", seed}, {"faults", rows}}.dump(2);
  return clean ? 0 : 1;
}
