#include "daemon/news/interlocks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/api/api_message.h"
#include "daemon/devices/bed_pictures.h"
#include "daemon/devices/device_places.h"
#include "daemon/news/cell_alarms.h"
#include "daemon/unit/disk_room.h"

namespace veneer::daemon {
namespace {

constexpr std::chrono::hours kOldBackup{7 * 24};

using enum InterlockState;

double seconds_since(std::chrono::system_clock::time_point then, std::chrono::system_clock::time_point now) {
  return std::max(0.0, std::chrono::duration<double>(now - then).count());
}

Interlock lid_lock(const LaserStatus& laser) {
  if (!laser.connected) return {"lid", kUnknown, "not told before the laser is connected", ""};
  if (!laser.lid_open) return {"lid", kUnknown, "the laser's controller has told of no lid switch", ""};
  if (*laser.lid_open) return {"lid", kBlocks, "the lid is open", "Close the lid."};
  return {"lid", kGood, "closed", ""};
}

// Most reasons say themselves what to do. A viewer, who is told no reason, can do nothing about it.
Interlock unconnected_lock(const std::string& why, bool tell_why) {
  if (!tell_why) return {"machine", kBlocks, kLaserIsNotConnected, ""};
  const nlohmann::json told = error_json("", why);
  if (told["remedy"].is_null()) return {"machine", kBlocks, why, "Reset tries to connect it again."};
  std::string remedy = told["remedy"];
  remedy.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(remedy.front())));
  remedy += remedy.find("Reset") == std::string::npos ? ", then Reset." : ".";
  return {"machine", kBlocks, told["sentence"], remedy};
}

// Where its own place stands in the chain: a machine without homing switches never finds its corner itself.
Interlock place_lock(const LaserStatus& laser, bool finds_home) {
  if (!laser.homed && finds_home)
    return {"machine", kWarns, "the laser is connected and not homed yet", "Reset homes it."};
  if (!laser.homed)
    return {"machine", kWarns, "the laser has no homing switches and does not count from its corner yet",
            "Reset takes the place where its head stands as its corner, or brings the head back to the corner it was "
            "given."};
  // Door:0 waits for whatever is started next, Door:3 is on its way out of it.
  const bool closed_again = laser.state == "Door:0" || laser.state == "Door:3";
  return {"machine", kGood,
          fmt::format("{}{}, its controller says {}",
                      finds_home ? "homed" : "no homing switches, it counts from the corner it was given",
                      closed_again ? ", the lid is closed again" : "", laser.state),
          ""};
}

// Its link, and what its own pins have stopped: a limit, a door.
Interlock machine_lock(const LaserStatus& laser, const InterlockFacts& facts) {
  const bool asked = !laser.why_not_connected.empty();
  if (!laser.connected && !asked)
    return {"machine", kUnknown, "nobody has connected the laser yet", "Reset connects and homes it."};
  if (!laser.connected) return unconnected_lock(laser.why_not_connected, facts.tell_why);
  if (laser.state.starts_with("Alarm"))
    return {
        "machine", kBlocks,
        fmt::format("the controller says {}, as after a STOP in the midst of a move, at a limit, or when it has lost "
                    "its place",
                    laser.state),
        "See that the head is free, then Clear and Reset."};
  if (laser.state == "Door" || laser.state == "Door:1" || laser.state == "Door:2")
    return {"machine", kBlocks, fmt::format("the controller says {}: its door is open", laser.state),
            "Close the door."};
  // While no guardian watches, that is what it says.
  const bool guarded = !facts.guardian || facts.guardian->ok();
  if (guarded && !laser.refusal.empty()) return {"machine", kBlocks, laser.refusal, ""};
  return place_lock(laser, facts.finds_home);
}

Interlock stop_lock(const CellView& view) {
  if (view.state == CellState::kAborting || view.state == CellState::kAborted)
    return {"stop", kBlocks, view.reason.empty() ? "the cell is aborted" : view.reason,
            "See to the cause, then Clear and Reset."};
  if (view.state == CellState::kHolding || view.state == CellState::kHeld)
    return {"stop", kBlocks, view.reason.empty() ? "the cut is held" : view.reason,
            "Unhold once nothing stands in the way."};
  return {"stop", kGood, "neither is in force", ""};
}

Interlock guardian_lock(const std::optional<Status>& guardian) {
  if (!guardian) return {"guardian", kUnknown, "nobody was asked whether a guardian watches", ""};
  if (*guardian) return {"guardian", kGood, "it watches", ""};
  return {"guardian", kBlocks, guardian->error().message,
          "It comes back by itself within seconds; if it does not, start the cell's service again."};
}

Interlock consent_lock(const CellView& view, const std::vector<std::string>& confirm) {
  if (view.alone) return {"consent", kGood, "an operator has said go for what runs", ""};
  switch (view.state) {
    case CellState::kSuspended:
      if (!view.load || !view.load->found)
        return {"consent", kBlocks, "no panel is proven to lie on the bed",
                view.load ? fmt::format("Lay panel {} on the bed.", view.load->panel.value) : ""};
      return {"consent", kBlocks, "nobody has said Unsuspend for this panel yet",
              confirm.empty() ? "An operator at the machine says Unsuspend."
                              : fmt::format("See to {}, tick each, then say Unsuspend.", fmt::join(confirm, ", "))};
    case CellState::kUnsuspending:
    case CellState::kExecute:
    case CellState::kHolding:
    case CellState::kHeld:
    case CellState::kUnholding:
      return {"consent", kGood, "an operator has said go for this panel", ""};
    default:
      return {"consent", kGood, "nothing is about to be cut", ""};
  }
}

Interlock certificates_lock(const std::vector<CellNeeds::Certificate>& certificates) {
  if (certificates.empty()) return {"certificates", kUnknown, "they have not been read yet", ""};
  std::vector<std::string> wrong;
  bool blocks = false;
  for (const CellNeeds::Certificate& one : certificates) {
    if (one.state == CertificateState::kValid) continue;
    wrong.push_back(certificate_words(one));
    blocks |= one.kind != db::CertificateKind::kScanner;  // without it nothing is scanned, but what is may be cut
  }
  if (wrong.empty()) return {"certificates", kGood, "all certificates are valid", ""};
  return {"certificates", blocks ? kBlocks : kWarns, fmt::format("{}", fmt::join(wrong, "; ")),
          "Calibrate it, on the screen Calibration."};
}

Interlock device_lock(const char* name, const DeviceNote& note, InterlockState failed, const InterlockFacts& facts,
                      const char* kind, const char* remedy) {
  Interlock out{name, kUnknown, fmt::format("no {} since the program began", kind), ""};
  if (!note.at) return out;
  out.age_s = seconds_since(*note.at, facts.now);
  if (note.outcome) {
    out.state = kGood, out.sentence = fmt::format("the last {} came out", kind);
    return out;
  }
  out.state = failed, out.remedy = remedy;
  out.sentence = facts.tell_why ? note.outcome.error().message
                                : fmt::format("the last {} did not come out; an operator is told why", kind);
  return out;
}

// A camera whose program hangs still gives pictures, and a simulated one sees no real bed.
Interlock camera_lock(const InterlockFacts& facts) {
  Interlock out = device_lock("camera", facts.camera, kBlocks, facts, "picture of the bed",
                              "See that the camera is plugged in and sees the bed, then look at the bed again.");
  if (!facts.stock_refusal.empty()) return {"camera", kBlocks, facts.stock_refusal, "", out.age_s};
  if (out.state != kGood) return out;
  const double behind = std::chrono::duration<double>(facts.camera.behind).count();
  if (facts.picture_fresh && facts.camera.behind <= BedPictures::kOldest) return out;
  out.state = kBlocks;
  if (facts.camera.behind > BedPictures::kOldest)
    out.sentence = fmt::format("the last picture of the bed was {:.0f} s old already when it was asked for", behind);
  else
    out.sentence = facts.tell_why ? facts.picture_fresh.error().message
                                  : "the last picture of the bed proves nothing; an operator is told why";
  out.remedy = "See that the program that takes the camera's pictures runs, then look at the bed again.";
  return out;
}

Interlock disk_lock(const std::optional<std::uintmax_t>& free_bytes) {
  if (!free_bytes) return {"disk", kUnknown, "the disk has not said how much room is left", ""};
  const std::string room = fmt::format("{:.1f} GB are free", static_cast<double>(*free_bytes) / 1e9);
  if (*free_bytes >= kLittleRoom) return {"disk", kGood, room, ""};
  if (!check_room(free_bytes)) return {"disk", kBlocks, kDiskIsNearlyFull, "Make room on the disk."};
  return {"disk", kWarns, room, "Make room on the disk before it is full: a cut cannot be booked on a full one."};
}

Interlock backup_lock(const InterlockFacts& facts) {
  if (!facts.backups_silent.empty()) return {"backup", kWarns, facts.backups_silent, ""};
  if (!facts.backups) return {"backup", kUnknown, "nobody has looked for backups yet", ""};
  constexpr const char* kMake = "Make one: with the button in Settings, or with veneerctl db backup.";
  if (!facts.backups->newest_at) return {"backup", kWarns, "no backup was made yet", kMake};
  Interlock out{"backup", kGood, "there is a backup", ""};
  out.age_s = seconds_since(*facts.backups->newest_at, facts.now);
  if (facts.now - *facts.backups->newest_at > kOldBackup)
    out.state = kWarns, out.sentence = "the newest backup is old", out.remedy = kMake;
  return out;
}

Interlock database_lock(const CellNeeds& needs) {
  if (needs.database_busy.empty()) return {"database", kGood, "sound", ""};
  return {"database", kBlocks, needs.database_busy,
          needs.database_damaged ? "veneerctl db check says what is damaged." : "Wait until it is checked."};
}

}  // namespace

std::string_view to_string(InterlockState state) {
  switch (state) {
    case kGood:
      return "good";
    case kWarns:
      return "warns";
    case kBlocks:
      return "blocks";
    case kUnknown:
      break;
  }
  return "unknown";
}

std::vector<Interlock> interlocks(const CellView& view, const LaserStatus& laser, const CellNeeds& needs,
                                  const InterlockFacts& facts) {
  return {lid_lock(laser),
          machine_lock(laser, facts),
          stop_lock(view),
          guardian_lock(facts.guardian),
          consent_lock(view, needs.confirm),
          certificates_lock(needs.certificates),
          camera_lock(facts),
          device_lock("scanner", facts.scanner, kWarns, facts, "scan",
                      "See that the scanner is switched on and its cable is in, then scan again."),
          disk_lock(facts.free_bytes),
          backup_lock(facts),
          database_lock(needs)};
}

nlohmann::json to_json(const std::vector<Interlock>& chain) {
  nlohmann::json out = nlohmann::json::array();
  for (const Interlock& one : chain)
    out.push_back({{"name", one.name},
                   {"state", to_string(one.state)},
                   {"sentence", one.sentence},
                   {"remedy", one.remedy.empty() ? nlohmann::json() : nlohmann::json(one.remedy)},
                   {"age_s", one.age_s ? nlohmann::json(std::llround(*one.age_s)) : nlohmann::json()}});
  return out;
}

}  // namespace veneer::daemon
