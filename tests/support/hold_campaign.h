// A campaign of Holds: the real unit on the real drivers' cores on simulated machines, one Hold a run at a drawn
// moment, in one thread on a clock that stands still. After Holding was announced no piece may be begun until an
// operator's Unhold, and none in an old pose after the lid was open.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::tests {

inline constexpr std::array<std::string_view, 4> kHoldKinds = {"grbl", "grbl, lid", "lihuiyu", "lihuiyu, lid"};

struct HoldRun {
  bool held = false;         // the Hold was taken
  bool refused = false;      // it came too late: nothing was left to burn
  bool aborted = false;      // the machine was in doubt (an opened lid)
  bool nudged = false;       // hands moved the panel while the lid was open
  int begun_after = 0;       // pieces begun after Holding was announced and before Unhold: never
  int begun_askew = 0;       // pieces begun after the panel was moved: never
  double burnt_held_mm = 0;  // burnt between Held and Unhold: never
  int looks_past_head = 0;   // between two pieces, the head in the picture: never on a machine that can be jogged
  std::string broken;        // any other promise: a piece burnt twice or not at all, a wrong end
};

// `kind` is one of kHoldKinds.
HoldRun run_with_hold(std::string_view kind, std::uint64_t seed);

struct HoldRow {
  std::string_view kind;
  int runs = 0, held = 0, refused = 0, aborted = 0, nudged = 0;
  int begun_after = 0, begun_askew = 0, looks_past_head = 0, broken = 0;
  double burnt_held_mm = 0;
  std::vector<std::string> complaints;  // with the seed that shows it again
  bool clean() const { return begun_after == 0 && begun_askew == 0 && broken == 0 && burnt_held_mm == 0; }
};

// Runs with the seeds `first_seed`, `first_seed` + 1, ...
HoldRow run_hold_campaign(std::string_view kind, int runs, std::uint64_t first_seed);

}  // namespace veneer::tests
