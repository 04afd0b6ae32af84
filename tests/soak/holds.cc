// The whole campaign of Holds as a table: both families, with and without lid, 250 of each, so a thousand. Exits 1 when
// a piece was begun that must not have been.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tests/soak/campaign_report.h"
#include "tests/soak/campaigns.h"
#include "tests/support/hold_campaign.h"

namespace veneer::soak {

int holds(int argc, char** argv) {
  using namespace tests;
  const CampaignOptions options =
      read_campaign_options(argc, argv, "Holds at drawn moments, on simulated machines", "veneer-soak holds");
  nlohmann::json rows = nlohmann::json::array();
  bool clean = true;
  std::vector<std::string> remarks;
  fmt::print("{:<16}{:>6}{:>7}{:>10}{:>9}{:>8} |{:>13}{:>13}{:>11}{:>8}\n", "machine", "runs", "held", "too late",
             "aborted", "nudged", "begun after", "begun askew", "burnt, mm", "broken");
  for (const std::string_view kind : kHoldKinds) {
    if (!options.wants(kind)) continue;
    const HoldRow row = run_hold_campaign(kind, options.runs, options.seed);
    fmt::print("{:<16}{:>6}{:>7}{:>10}{:>9}{:>8} |{:>13}{:>13}{:>11.3f}{:>8}\n", row.kind, row.runs, row.held,
               row.refused, row.aborted, row.nudged, row.begun_after, row.begun_askew, row.burnt_held_mm, row.broken);
    clean = clean && row.clean();
    remarks.insert(remarks.end(), row.complaints.begin(), row.complaints.end());
    rows.push_back({{"machine", row.kind},
                    {"runs", row.runs},
                    {"held", row.held},
                    {"too_late", row.refused},
                    {"aborted", row.aborted},
                    {"nudged", row.nudged},
                    {"begun_after_holding", row.begun_after},
                    {"begun_in_an_old_pose", row.begun_askew},
                    {"burnt_while_held_mm", row.burnt_held_mm},
                    {"promises_broken", row.broken}});
  }
  return finish_campaign(options, rows, remarks, clean);
}

}  // namespace veneer::soak
