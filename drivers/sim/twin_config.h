// veneer-twin's configuration file (TOML). It reads [sim] time_scale, [twin], [twin.scanner], [twin.camera],
// [twin.bed], [twin.laser] and [twin.rough]; a key nobody reads there is an error. Tables of the daemon may stand in
// the same file and are left to it.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "drivers/sim/cell_truth.h"

namespace veneer::sim {

struct TwinConfig {
  TwinSettings settings;
  double boot_seconds = 0.1;        // device time of the controller's bootloader after its port was opened
  std::string controller = "grbl";  // grbl | lihuiyu-m2 | lihuiyu-m3
  bool reset_on_open = true;        // opening the port pulses DTR, which resets the board
};

// kNotFound, or kInvalidArgument naming file, line and key. [twin] preset is where [twin.rough] begins; `preset`, when
// it is given, takes its place.
Result<TwinConfig> load_twin_config(const std::filesystem::path& file, const std::string& preset = "");

}  // namespace veneer::sim
