// What sentences leave out for whoever only looks on: why the laser is not connected, and every port and path.
//
// Pure. Reactor only, as the book is.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/config.h"
#include "daemon/news/alarm_book.h"

namespace veneer::daemon {

// In every text of `told`, however deep. `why` the laser is not connected just now ("": it is), or was when an alarm of
// this book began, is left out whole: it may name what no configuration knows (device_places.h).
void leave_out_places(nlohmann::json& told, const std::string& why, const AlarmBook& alarms, const LaserConfig& laser);

}  // namespace veneer::daemon
