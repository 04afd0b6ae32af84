// The whole fault campaign of the Lihuiyu driver as a table: kinds of faults by seeds, how the jobs ended, and what
// must never happen. Exits 1 when it did.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tests/soak/campaign_report.h"
#include "tests/soak/campaigns.h"
#include "tests/support/lihuiyu_campaign.h"

namespace veneer::soak {

int lihuiyu_faults(int argc, char** argv) {
  using namespace tests;
  const CampaignOptions options =
      read_campaign_options(argc, argv, "Faults on a Lihuiyu board and its USB link", "veneer-soak lihuiyu-faults");
  nlohmann::json rows = nlohmann::json::array();
  bool clean = true;
  std::vector<std::string> remarks;
  fmt::print("{:<18}{:>6}{:>10}{:>9}{:>9}{:>14}{:>11} |{:>7}{:>8}{:>11}{:>12}{:>9}\n", "fault", "runs", "complete",
             "aborted", "suspect", "software-off", "relay-off", "wrong", "broken", "moved, mm", "Hausd., mm",
             "queue, s");
  for (const std::string_view kind : kBoardFaults) {
    if (!options.wants(kind)) continue;
    const BoardRow row = run_board_campaign(kind, options.runs, options.seed);
    fmt::print("{:<18}{:>6}{:>10}{:>9}{:>9}{:>14}{:>11} |{:>7}{:>8}{:>11.3f}{:>12.4f}{:>9.3f}\n", row.kind, row.runs,
               row.complete, row.aborted, row.suspect, row.software_off, row.relay_off, row.wrong, row.broken,
               row.without_consent_mm, row.hausdorff_mm, row.longest_queue_s);
    clean = clean && row.clean();
    remarks.insert(remarks.end(), row.complaints.begin(), row.complaints.end());
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
  return finish_campaign(options, rows, remarks, clean);
}

}  // namespace veneer::soak
