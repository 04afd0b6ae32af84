// The whole fault campaign of the GRBL driver as a table: kinds of faults by seeds, how the jobs ended, and what must
// never happen. Exits 1 when it did.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/fault_campaign.h"

int main(int argc, char** argv) {
  using namespace veneer::tests;
  CLI::App app{"Faults on the GRBL driver's wire and controller", "veneer-soak-faults"};
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
  fmt::print("{:<18}{:>6}{:>10}{:>6}{:>9}{:>9} |{:>7}{:>12}{:>8}{:>11}{:>12}{:>9}{:>9}{:>10}\n", "fault", "runs",
             "complete", "held", "aborted", "suspect", "wrong", "feed/power", "broken", "moved, mm", "Hausd., mm",
             "queue, s", "longer", "standing");
  for (std::size_t kind = 0; kind < kWireFaults; ++kind) {
    const FaultRow row = run_campaign(static_cast<WireFault>(kind), runs, seed);
    fmt::print("{:<18}{:>6}{:>10}{:>6}{:>9}{:>9} |{:>7}{:>12}{:>8}{:>11.3f}{:>12.4f}{:>9.3f}{:>9}{:>10}\n",
               name_of(row.kind), row.runs, row.complete, row.held, row.aborted, row.suspect, row.wrong,
               row.wrong_energy, row.broken, row.without_consent_mm, row.hausdorff_mm, row.longest_queue_s,
               row.lengthened, row.standing);
    clean = clean && row.clean();
    complaints.insert(complaints.end(), row.complaints.begin(), row.complaints.end());
    rows.push_back({{"fault", name_of(row.kind)},
                    {"runs", row.runs},
                    {"complete", row.complete},
                    {"held", row.held},
                    {"aborted", row.aborted},
                    {"suspect", row.suspect},
                    {"wrong_unreported", row.wrong},
                    {"feed_or_power_unreported", row.wrong_energy},
                    {"promises_broken", row.broken},
                    {"moved_without_consent_mm", row.without_consent_mm},
                    {"hausdorff_mm", row.hausdorff_mm},
                    {"longest_queue_s", row.longest_queue_s},
                    {"lengthened_by_changed_lines", row.lengthened},
                    {"beam_stood_by_changed_lines", row.standing}});
  }
  for (std::size_t i = 0; i < complaints.size() && i < 40; ++i) fmt::print("{}\n", complaints[i]);
  if (!out.empty())
    std::ofstream(out) << nlohmann::json{{"schema_version", 1}, {"seed", seed}, {"faults", rows}}.dump(2);
  return clean ? 0 : 1;
}
