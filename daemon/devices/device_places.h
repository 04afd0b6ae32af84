// What is not told to whoever only looks on: where devices are plugged in, and which files stand for them. Sentences
// name both, for people who can do something about it.
//
// Pure; thread-safe.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/config.h"

namespace veneer::daemon {

// In the place of any sentence about why the laser is not connected, which may be that it answers and is refused: what
// it names may be known to no configuration, as the sockets where boards of its kind were found.
inline constexpr const char* kLaserIsNotConnected = "the laser is not connected; an operator is told why";

// In every text of `told`, however deep, that holds this reason why the laser is not connected: "": there is none.
void strike_why(nlohmann::json& told, const std::string& why);

// In every text of `told`, however deep: no whole path, and no port of the laser.
void strike_places(nlohmann::json& told, const LaserConfig& laser);

}  // namespace veneer::daemon
