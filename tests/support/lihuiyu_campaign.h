// A campaign of faults against the Lihuiyu driver: jobs on the simulated machine, one fault a run, on a clock that
// stands still. What went wrong is drawn from a seed; how the run ended is judged by what was truly burnt.
//
// Behind every run stands a relay on the laser enable, as the cell has one: it drops a second after the job was
// aborted. Whether the beam was out by then without it is counted apart.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::tests {

inline constexpr std::array<std::string_view, 14> kBoardFaults = {
    "reject_packet", "truncate_packet", "lose_packet",   "lose_packet_reply",
    "lose_status",   "repeat_status",   "garble_status", "busy_forever",
    "stall",         "unplug",          "replug",        "transfer_error",
    "brown_out",     "open_lid"};

struct BoardRun {
  bool complete = false, aborted = false, suspect = false;
  std::string wrong;         // a piece reported verified that was not burnt as planned, or burnt and not suspect
  std::string broken;        // any other promise that was broken: beam on at the end, no ending, no sentence
  bool software_off = true;  // after an abort the beam was out before the relay dropped
  double hausdorff_mm = 0;   // the worst of the pieces reported verified
  double longest_queue_s = 0;
  double without_consent_mm = 0;  // motion after what was queued when the run ended, also after a reconnect
};

BoardRun run_with_board_fault(std::string_view kind, std::uint64_t seed);

struct BoardRow {
  std::string_view kind;
  int runs = 0, complete = 0, aborted = 0, suspect = 0, software_off = 0, relay_off = 0, wrong = 0, broken = 0;
  double hausdorff_mm = 0, longest_queue_s = 0, without_consent_mm = 0;
  std::vector<std::string> complaints;  // with the seed that shows it again
  bool clean() const { return wrong == 0 && broken == 0 && without_consent_mm == 0 && longest_queue_s <= 1.0; }
};

// Runs with the seeds `first_seed`, `first_seed` + 1, ...
BoardRow run_board_campaign(std::string_view kind, int runs, std::uint64_t first_seed);

}  // namespace veneer::tests
