// A campaign of faults against the GRBL driver: jobs on the simulated controller, one fault a run, on a clock that
// stands still. What went wrong is drawn from a seed; how the run ended is judged by what was truly burnt.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::tests {

enum class WireFault {
  kDropOk,         // an answer is lost
  kDuplicateOk,    // an answer comes twice
  kGarbledByte,    // a byte to the controller arrives as another
  kNoise,          // bytes nobody sent arrive at the controller, control bytes among them
  kGarbledAnswer,  // a byte from the controller arrives as another
  kDroppedByte,    // a byte to the controller never arrives
  kTruncatedLine,  // a line loses its tail, its newline arrives
  kFusedLines,     // a newline never arrives
  kFusedValid,     // bytes around a newline never arrive, and what is left of two lines is one valid line
  kPartialWrites,  // every write goes in small pieces with pauses
  kLinkStall,      // for 0.1 to 60 s no byte passes in either direction, then all of them do
  kFirmwareHang,   // the controller stops for ever, dark
  kIoError,        // the host's port fails, the controller goes on
  kReplug,         // the cable is pulled and put back
  kBanner,         // the controller resets by itself
  kError,          // error:N
  kAlarm,          // ALARM:N
  kLidOpen,        // the lid is opened and closed again; the operator resumes, or does not
};
inline constexpr std::size_t kWireFaults = 18;
std::string_view name_of(WireFault kind);
// Does it change lines into others the controller may take? A lost point makes a motion a thousand times longer, and
// nobody can bound that before it is seen.
bool changes_lines(WireFault kind);

struct FaultRun {
  enum class Ending { kComplete, kHeld, kAborted };
  Ending ending = Ending::kAborted;
  bool suspect = false;        // a piece was reported suspect
  std::string wrong;           // a piece reported verified that was not burnt as planned, or burnt and not suspect
  std::string wrong_energy;    // ... that lies where it should, but with another feed or power
  std::string broken;          // any other promise that was broken: beam on at the end, no ending, no sentence
  double hausdorff_mm = 0;     // the worst of the pieces reported verified
  double longest_queue_s = 0;  // by the controller's own watchdog
  double beam_at_rest_s = 0;
  double unaccused_mm = 0;        // how far off its path the beam burnt beyond where the driver says that it may have
  std::string unaccused;          // the driver's sentence then
  double without_consent_mm = 0;  // motion later than what was queued when the run ended, also after a reconnect
};

FaultRun run_with_fault(WireFault kind, std::uint64_t seed);

struct FaultRow {
  WireFault kind{};
  int runs = 0, complete = 0, held = 0, aborted = 0, suspect = 0;
  int wrong = 0, wrong_energy = 0, broken = 0;
  // Where an X or Y arrived as a Z: the beam stands while the controller moves an axis the machine may not have.
  int standing = 0;
  int lengthened = 0;  // more than 1.0 s of motion in the controller, because a line was changed on its way
  int unaccused = 0;
  double hausdorff_mm = 0, longest_queue_s = 0, without_consent_mm = 0, unaccused_mm = 0;
  std::vector<std::string> complaints;  // with the seed that shows it again
  std::vector<std::string> notes;       // of what nobody can prevent, likewise
  bool clean() const { return wrong == 0 && broken == 0 && without_consent_mm == 0; }
};

// Runs with the seeds `first_seed`, `first_seed` + 1, ...
FaultRow run_campaign(WireFault kind, int runs, std::uint64_t first_seed);

}  // namespace veneer::tests
