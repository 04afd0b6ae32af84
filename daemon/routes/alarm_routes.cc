// Alarms: what needs somebody, and who has seen it.
#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/routes/cell_routes.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json or_null(const std::string& text) { return text.empty() ? json() : json(text); }

json to_json(const Alarm& alarm) {
  return {{"id", alarm.id},
          {"about", alarm.what.key},
          {"urgent", alarm.what.urgent},
          {"sentence", alarm.what.sentence},
          {"state", to_string(alarm.state)},
          {"since", alarm.since},
          {"until", or_null(alarm.until)},
          {"acknowledged_by", or_null(alarm.seen_by)},
          {"acknowledged_at", or_null(alarm.seen_at)}};
}

json list_json(const AlarmBook& book) {
  json list = json::array();
  for (auto alarm = book.alarms().rbegin(); alarm != book.alarms().rend(); ++alarm) list.push_back(to_json(*alarm));
  return {{"alarms", std::move(list)}};
}

void acknowledge(const AlarmServices& s, const ApiRequest& request, const Reply& reply) {
  const auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  if (const Status seen = s.book.acknowledge(*id, request.caller.who, utc_timestamp()); !seen)
    return reply(ApiReply::error(seen.error()));
  s.on_changed();
  reply(ApiReply::json({{"acknowledged", 1}}));
}

}  // namespace

void bind_alarm_routes(Router& router, const AlarmServices& s) {
  router.bind("listAlarms", [s](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(list_json(s.book))); });
  router.bind("acknowledgeAlarm",
              [s](const ApiRequest& request, const Reply& reply) { acknowledge(s, request, reply); });
  router.bind("acknowledgeAlarms", [s](const ApiRequest& request, const Reply& reply) {
    const int seen = s.book.acknowledge_all(request.caller.who, utc_timestamp());
    s.on_changed();
    reply(ApiReply::json({{"acknowledged", seen}}));
  });
}

}  // namespace veneer::daemon
