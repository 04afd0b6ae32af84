// veneer-soak CAMPAIGN [OPTIONS]: campaigns that take longer than CI has; './dev soak' runs them with fresh seeds. One
// program, because a dozen that share most of their headers take the compiler three times as long.
#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <string_view>

#include "tests/soak/campaigns.h"

namespace {

struct Campaign {
  std::string_view name, what;
  int (*run)(int argc, char** argv);
};

using namespace veneer::soak;

constexpr std::array kCampaigns{
    Campaign{"cell-life", "jobs on the simulated cell until its wood is used up, and the daemon's memory", cell_life},
    Campaign{"clients", "what hostile clients cost STOP and the console", clients},
    Campaign{"eyes", "masks of panels of every board and wood", eyes},
    Campaign{"fates", "reconciliation on panels of every board, wood and lid", fates},
    Campaign{"grbl-faults", "faults on the GRBL driver's wire and controller", grbl_faults},
    Campaign{"guardian-kills", "SIGKILL in a burn, until the beam is off", guardian_kills},
    Campaign{"holds", "Holds at drawn moments", holds},
    Campaign{"holes", "screw holes that are taken for wood", holes},
    Campaign{"idle", "the daemon's processor time and memory while nothing goes on", idle},
    Campaign{"lihuiyu-faults", "faults on a Lihuiyu board and its USB link", lihuiyu_faults},
    Campaign{"plan-stops", "a stop request, until planning has ended", plan_stops},
    Campaign{"sights", "how well the bed is known after calibration", sights},
    Campaign{"stop-latency", "STOP, from the request to the byte on the wire", stop_latency},
};

}  // namespace

int main(int argc, char** argv) {
  const std::string_view name = argc > 1 ? argv[1] : "";
  for (const Campaign& campaign : kCampaigns)
    if (campaign.name == name) return campaign.run(argc, argv);
  const bool asked = name == "-h" || name == "--help";
  std::FILE* const out = asked ? stdout : stderr;
  fmt::print(out, "usage: veneer-soak CAMPAIGN [OPTIONS]    (--help after its name tells a campaign's options)\n\n");
  for (const Campaign& campaign : kCampaigns) fmt::print(out, "  {:<16}{}\n", campaign.name, campaign.what);
  return asked ? 0 : 2;
}
