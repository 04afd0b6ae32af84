#include "daemon/news/kept_alarms.h"

#include <string>
#include <utility>

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr int kBookFormat = 1;

json alarm_to_json(const Alarm& alarm) {
  return {{"id", alarm.id},
          {"about", alarm.what.key},
          {"urgent", alarm.what.urgent},
          {"count", alarm.what.count},
          {"sentence", alarm.what.sentence},
          {"lasting", alarm.lasting},
          {"since", alarm.since},
          {"until", alarm.until},
          {"seen_by", alarm.seen_by},
          {"seen_at", alarm.seen_at}};
}

// Throws json::exception.
Alarm alarm_from_json(const json& one) {
  Alarm alarm;
  alarm.id = one.at("id");
  alarm.what = {one.at("about"), one.at("urgent"), one.at("sentence"), one.at("count")};
  alarm.lasting = one.at("lasting");
  alarm.since = one.at("since");
  alarm.until = one.at("until");
  alarm.seen_by = one.at("seen_by");
  alarm.seen_at = one.at("seen_at");
  return alarm;
}

}  // namespace

json book_to_json(const AlarmBook& book) {
  json alarms = json::array();
  for (const Alarm& alarm : book.alarms()) alarms.push_back(alarm_to_json(alarm));
  return {{"format", kBookFormat}, {"last_id", book.last_id()}, {"alarms", std::move(alarms)}};
}

std::optional<AlarmBook> book_from_json(const json& kept) {
  try {
    if (kept.at("format") != kBookFormat) return std::nullopt;
    std::deque<Alarm> alarms;
    for (const json& one : kept.at("alarms")) alarms.push_back(alarm_from_json(one));
    return AlarmBook(kept.at("last_id").get<std::int64_t>() + kAlarmsSkipped, std::move(alarms));
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace veneer::daemon
