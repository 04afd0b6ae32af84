// The whole fault campaign of the GRBL driver as a table: kinds of faults by seeds, how the jobs ended, and what must
// never happen. Exits 1 when it did.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tests/soak/campaign_report.h"
#include "tests/soak/campaigns.h"
#include "tests/support/fault_campaign.h"

namespace veneer::soak {

int grbl_faults(int argc, char** argv) {
  using namespace tests;
  const CampaignOptions options =
      read_campaign_options(argc, argv, "Faults on the GRBL driver's wire and controller", "veneer-soak grbl-faults");
  nlohmann::json rows = nlohmann::json::array();
  bool clean = true;
  std::vector<std::string> remarks;
  fmt::print("{:<18}{:>6}{:>10}{:>6}{:>9}{:>9} |{:>7}{:>12}{:>8}{:>11}{:>12}{:>9}{:>9}{:>10}\n", "fault", "runs",
             "complete", "held", "aborted", "suspect", "wrong", "feed/power", "broken", "moved, mm", "Hausd., mm",
             "queue, s", "longer", "standing");
  for (std::size_t kind = 0; kind < kWireFaults; ++kind) {
    if (!options.wants(name_of(static_cast<WireFault>(kind)))) continue;
    const FaultRow row = run_campaign(static_cast<WireFault>(kind), options.runs, options.seed);
    fmt::print("{:<18}{:>6}{:>10}{:>6}{:>9}{:>9} |{:>7}{:>12}{:>8}{:>11.3f}{:>12.4f}{:>9.3f}{:>9}{:>10}\n",
               name_of(row.kind), row.runs, row.complete, row.held, row.aborted, row.suspect, row.wrong,
               row.wrong_energy, row.broken, row.without_consent_mm, row.hausdorff_mm, row.longest_queue_s,
               row.lengthened, row.standing);
    clean = clean && row.clean();
    remarks.insert(remarks.end(), row.complaints.begin(), row.complaints.end());
    remarks.insert(remarks.end(), row.notes.begin(), row.notes.end());
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
  return finish_campaign(options, rows, remarks, clean);
}

}  // namespace veneer::soak
