// Which laser, scanner and camera the cell has: as the configuration file says, or, where it allows that and has a
// simulated one, as a maintainer chose.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/config.h"
#include "daemon/config_section.h"

namespace veneer::daemon {

// [devices], [laser], [scanner], [camera] and [sim] of the configuration file. What is wrong is added to `errors`.
void read_devices(const toml::table& root, const std::string& file, Config& config, std::vector<std::string>& errors);

// What is asked of the operator where nothing is written of it.
BeforeMotionConfig usual_before_motion(const LaserConfig& laser);

// The content of chosen_devices.toml; all three devices must be there, each whole. An error names `file` and what to
// do.
Result<ChosenDevices> read_chosen_devices(std::string_view text, const std::filesystem::path& file);
// nullopt when there is none. One that is there and cannot be read is an error.
Result<std::optional<ChosenDevices>> read_chosen_devices(const std::filesystem::path& file);

// Puts them in the place of what the file simulates. Nothing that was written beside a simulated laser says anything of
// a real one: neither how it is focused nor what is asked before it moves.
void take_chosen(const ChosenDevices& chosen, Config& config);

}  // namespace veneer::daemon
