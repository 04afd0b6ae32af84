// The chain of what must be so before the beam may come on, and of what can wait but should not be forgotten: each link
// with its state and, where it is not as it should be, what to do. Pure.
//
// What nobody has told is not known, and says so. The machine's own emergency stop is none of them: no controller
// reports it.
#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/devices/noted_devices.h"
#include "daemon/news/next_step.h"
#include "daemon/records/backup_disk.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

enum class InterlockState {
  kGood,
  kWarns,    // nothing waits for it yet
  kBlocks,   // no beam may begin, or what it is for cannot be done
  kUnknown,  // nobody has told
};
std::string_view to_string(InterlockState state);  // "good", "warns", "blocks", "unknown", as the API has it

struct Interlock {
  std::string name;  // "lid", "machine", "stop", "guardian", "consent", "certificates", "camera", "scanner", ...
  InterlockState state = InterlockState::kUnknown;
  std::string sentence;              // how it is
  std::string remedy;                // what to do; "" where nothing is to be done
  std::optional<double> age_s = {};  // since the picture, scan or backup that it speaks of
};

// What the cell's view, laser and needs do not tell.
struct InterlockFacts {
  std::optional<Status> guardian;  // whether somebody would darken the machine; nothing where nobody is asked
  DeviceNote camera, scanner;
  Status picture_fresh = Ok();                // BedPictures::last_fresh()
  std::string stock_refusal;                  // RunnerOptions::stock_refusal
  std::optional<std::uintmax_t> free_bytes;   // on the data's disk; nothing while it does not say
  std::optional<BackupsSeen> backups;         // nothing before the first look
  std::string backups_silent;                 // BackupDisk::silence()
  std::chrono::system_clock::time_point now;  // for ages
  bool tell_why = true;                       // false: to viewers, who are told no ports and no paths
  bool finds_home = true;                     // LaserLimits::finds_home
};

std::vector<Interlock> interlocks(const CellView& view, const LaserStatus& laser, const CellNeeds& needs,
                                  const InterlockFacts& facts);
nlohmann::json to_json(const std::vector<Interlock>& chain);

}  // namespace veneer::daemon
