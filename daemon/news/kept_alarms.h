// The book of alarms as JSON, for the file that lets it outlive the daemon. Pure.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/news/alarm_book.h"

namespace veneer::daemon {

// Numbers go on so many after the last that was written: some may have been told of that were not.
inline constexpr std::int64_t kAlarmsSkipped = 100;

nlohmann::json book_to_json(const AlarmBook& book);
// None of what no such book was written to.
std::optional<AlarmBook> book_from_json(const nlohmann::json& json);

}  // namespace veneer::daemon
