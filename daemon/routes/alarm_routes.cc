// Alarms: what needs somebody, and who has seen it.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/clock.h"
#include "daemon/api/page.h"
#include "daemon/news/left_out_places.h"
#include "daemon/routes/cell_routes.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json null_when_empty(const std::string& text) { return text.empty() ? json() : json(text); }

json alarm_json(const Alarm& alarm) {
  return {{"id", alarm.id},
          {"about", alarm.what.key},
          {"urgent", alarm.what.urgent},
          {"sentence", alarm.what.sentence},
          {"state", to_string(alarm.state)},
          {"since", alarm.since},
          {"until", null_when_empty(alarm.until)},
          {"acknowledged_by", null_when_empty(alarm.seen_by)},
          {"acknowledged_at", null_when_empty(alarm.seen_at)}};
}

// A page is put together on the loop that answers STOP: a short one.
constexpr int kLongestAlarmPage = 100;

// Newest first: behind a number come those with lesser ones.
json list_json(const AlarmBook& book, const Page& page) {
  const auto most = static_cast<std::size_t>(std::min(page.limit, kLongestAlarmPage));
  json list = json::array();
  json next;
  for (auto alarm = book.alarms().rbegin(); alarm != book.alarms().rend() && next.is_null(); ++alarm) {
    if (page.after > 0 && alarm->id >= page.after) continue;
    if (list.size() < most)
      list.push_back(alarm_json(*alarm));
    else
      next = list.back()["id"];
  }
  return {{"alarms", std::move(list)}, {"next", std::move(next)}};
}

void list_alarms(const AlarmServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const Page page = read_page(query);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  json list = list_json(s.book, page);
  if (request.caller.role < Role::kOperator) leave_out_places(list["alarms"], "", s.book, s.config.laser);
  reply(ApiReply::json(list));
}

// Whoever says it names the newest of those that were in sight.
void acknowledge_alarms(const AlarmServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto up_to = body.whole("up_to", {0, 9e15});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const int seen = s.book.acknowledge_all(request.caller.who, utc_timestamp(),
                                          up_to.value_or(std::numeric_limits<std::int64_t>::max()));
  s.on_changed();
  reply(ApiReply::json({{"acknowledged", seen}}));
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
  router.bind("listAlarms", [s](const ApiRequest& request, const Reply& reply) { list_alarms(s, request, reply); });
  router.bind("acknowledgeAlarm",
              [s](const ApiRequest& request, const Reply& reply) { acknowledge(s, request, reply); });
  router.bind("tryNotices", [s](const ApiRequest&, const Reply& reply) {
    const auto task = s.try_notices();
    reply(task ? ApiReply::task(*task) : ApiReply::error(task.error()));
  });
  router.bind("acknowledgeAlarms",
              [s](const ApiRequest& request, const Reply& reply) { acknowledge_alarms(s, request, reply); });
}

}  // namespace veneer::daemon
