// Which laser, scanner and camera the cell has: as the configuration file says, or as an operator chose on the page
// where the file leaves it open.
#pragma once

#include <string>
#include <vector>

#include "daemon/config.h"
#include "daemon/config_section.h"

namespace veneer::daemon {

// One file of tables, and its name for errors.
struct DeviceTables {
  const toml::table& root;
  std::string name;
};

// Into laser, scanner, camera and sim of `config`. What is wrong is added to `errors`.
void read_devices(const DeviceTables& configured, const DeviceTables& chosen, Config& config,
                  std::vector<std::string>& errors);

}  // namespace veneer::daemon
