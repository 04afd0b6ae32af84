#include "daemon/news/left_out_places.h"

#include <nlohmann/json.hpp>

#include "daemon/devices/device_places.h"

namespace veneer::daemon {

// What failed for that reason is still told when the laser is connected again.
void leave_out_places(nlohmann::json& told, const std::string& why, const AlarmBook& alarms, const LaserConfig& laser) {
  strike_why(told, why);
  for (const Alarm& alarm : alarms.alarms())
    if (alarm.what.key == "laser") strike_why(told, alarm.what.sentence);
  strike_places(told, laser);
}

}  // namespace veneer::daemon
