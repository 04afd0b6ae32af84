// Who did what, what happened, and what became of every piece: all page by page, however long they have become.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/api/page.h"
#include "daemon/devices/device_places.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/search_words.h"
#include "db/events.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json text_or_null(const std::string& text) { return text.empty() ? json() : json(text); }

json row_json(const db::AuditEntry& row) {
  return {{"id", row.id},     {"at", row.at},         {"who", row.who},
          {"what", row.what}, {"detail", row.detail}, {"hash", row.hash}};
}

json row_json(const db::PieceOutcome& piece) {
  return {{"piece", piece.piece.value},
          {"mark", piece.mark},
          {"job", piece.job.value},
          {"job_name", piece.job_name},
          {"job_made", piece.job_made_at},
          {"panel", piece.panel ? json(piece.panel->value) : json()},
          {"state", db::to_string(piece.state)},
          {"since", text_or_null(piece.since)},
          {"run", piece.run ? json(piece.run->value) : json()},
          {"run_started", text_or_null(piece.run_started_at)},
          {"run_ended", text_or_null(piece.run_ended_at)},
          {"run_result", text_or_null(piece.run_result)},
          {"who", text_or_null(piece.who)}};
}

json row_json(const db::WoodStep& step) {
  const auto or_null = [](std::int64_t number) { return number == 0 ? json() : json(number); };
  return {{"step", step.number},
          {"at", step.at},
          {"panel", step.panel.value},
          {"allocation", step.allocation.value},
          {"state", db::to_string(step.state)},
          {"area_mm2", step.area.count()},
          {"job", or_null(step.job.value)},
          {"piece", or_null(step.piece.value)},
          {"mark", text_or_null(step.mark)},
          {"plan", or_null(step.leased_to.value)},
          {"run", step.run ? json(*step.run) : json()},
          {"who", text_or_null(step.who)},
          {"reason", text_or_null(step.reason)}};
}

json row_json(const db::EventRecord& event) {
  return {{"at", event.at},
          {"kind", event.kind},
          {"what", event.what},
          {"panel", event.panel ? json(event.panel->value) : json()},
          {"job", event.job ? json(event.job->value) : json()},
          {"piece", event.piece ? json(event.piece->value) : json()},
          {"run", event.run ? json(*event.run) : json()},
          {"who", text_or_null(event.who)}};
}

// "2026-05-01", "2026-05-01T07:30" and whatever more of it is given. Stored times are compared as text: without its Z
// the beginning of a time comes before every time that begins so.
std::optional<std::string> beginning_of_time(std::string text) {
  constexpr std::string_view kPattern = "dddd-dd-ddTdd:dd:dd.ddd";
  if (text.ends_with('Z')) text.pop_back();
  if (text.size() < 10 || text.size() > kPattern.size()) return std::nullopt;
  const bool like_it = std::equal(text.begin(), text.end(), kPattern.begin(),
                                  [](char c, char like) { return like == 'd' ? c >= '0' && c <= '9' : c == like; });
  return like_it ? std::optional(text) : std::nullopt;
}

// "run", as the beginnings of `what` are.
bool is_kind(std::string_view text) {
  return !text.empty() && text.size() <= 40 &&
         std::ranges::all_of(text, [](char c) { return (c >= 'a' && c <= 'z') || c == '-' || c == '_'; });
}

std::string read_time(RequestReader& query, const char* name) {
  const auto text = query.text(name);
  if (!text) return {};
  const auto begin = beginning_of_time(*text);
  if (!begin)
    query.refuse({ErrorCode::kInvalidArgument,
                  fmt::format("{} is no time: give it in UTC, as 2026-05-01 or 2026-05-01T07:30:00Z", name)});
  return begin.value_or("");
}

Result<json> audit_json(Repositories& r, const db::AuditFilter& filter, const Page& page) {
  auto rows = r.audit.read(filter, page.limit + 1);
  if (!rows) return rows.error();
  const auto head = r.audit.head();
  if (!head) return head.error();
  json out = {{"entries", json::array()}, {"head", {{"id", head->id}, {"hash", text_or_null(head->hash)}}}};
  out["next"] = cut_to_page(*rows, page, [](const db::AuditEntry& row) { return row.id; });
  for (const auto& row : *rows) out["entries"].push_back(row_json(row));
  return out;
}

Result<json> history_json(Repositories& r, const Page& page) {
  auto rows = r.jobs.outcomes(PieceId{page.after}, page.limit + 1);
  if (!rows) return rows.error();
  json out = {{"pieces", json::array()}};
  out["next"] = cut_to_page(*rows, page, [](const db::PieceOutcome& piece) { return piece.piece.value; });
  for (const auto& piece : *rows) out["pieces"].push_back(row_json(piece));
  return out;
}

Result<json> wood_json(Repositories& r, const Page& page) {
  auto rows = r.ledger.steps(page.after, page.limit + 1);
  if (!rows) return rows.error();
  json out = {{"steps", json::array()}};
  out["next"] = cut_to_page(*rows, page, [](const db::WoodStep& step) { return step.number; });
  for (const auto& step : *rows) out["steps"].push_back(row_json(step));
  return out;
}

// "P-0001". Whatever else stands there would be read as a pattern: it would find other panels' rows, and take its time.
bool is_panel_name(std::string_view text) {
  return text.size() > 2 && text.size() <= 20 && text.starts_with("P-") &&
         std::ranges::all_of(text.substr(2), [](char c) { return c >= '0' && c <= '9'; });
}

// "2026-05-01T07:30:00.000Z~wood~0~3~P-0001": behind this event.
std::string cursor_of(const db::EventPlace& place) {
  return fmt::format("{}~{}~{}~{}~{}", place.at, place.kind, place.part, place.step, place.panel);
}

// All of it is read, or a page of what was never meant would tell that nothing more has happened.
std::optional<db::EventPlace> place_in(std::string_view cursor) {
  std::vector<std::string_view> words;
  for (std::size_t from = 0; from <= cursor.size();) {
    const std::size_t end = std::min(cursor.find('~', from), cursor.size());
    words.push_back(cursor.substr(from, end - from));
    from = end + 1;
  }
  if (words.size() != 5 || !beginning_of_time(std::string(words[0])) || !std::ranges::count(db::kEventKinds, words[1]))
    return std::nullopt;
  db::EventPlace place{std::string(words[0]), std::string(words[1]), 0, 0, std::string(words[4])};
  const auto reads = [](std::string_view word, auto& number) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc() && end == word.data() + word.size() && number >= 0;
  };
  if (!reads(words[2], place.part) || !reads(words[3], place.step)) return std::nullopt;
  return place.panel.empty() || is_panel_name(place.panel) ? std::optional(place) : std::nullopt;
}

db::EventPlace read_place(RequestReader& query) {
  const auto cursor = query.text("cursor");
  if (!cursor) return {};
  const auto place = place_in(*cursor);
  if (!place) query.refuse({ErrorCode::kInvalidArgument, "this cursor is not valid: give `next` of the page before"});
  return place.value_or(db::EventPlace{});
}

Result<json> events_json(Repositories& r, const db::EventFilter& filter, const db::EventPlace& after, int limit) {
  auto events = db::Events(r.connection).read(filter, after, limit + 1);
  if (!events) return events.error();
  json out = {{"events", json::array()}, {"next", nullptr}};
  if (events->size() > static_cast<std::size_t>(limit)) {
    events->pop_back();
    out["next"] = cursor_of(db::place_of(events->back()));
  }
  for (const auto& event : *events) out["events"].push_back(row_json(event));
  return out;
}

std::optional<PanelId> read_panel(RequestReader& query) {
  const auto panel = query.text("panel");
  if (panel && !is_panel_name(*panel))
    query.refuse({ErrorCode::kInvalidArgument, "panel is no panel's name: give it as on its label, as P-0001"});
  return panel ? std::optional(PanelId{*panel}) : std::nullopt;
}

// "POST /api/v1/laser/connect {...}": what was asked for, which is no file of this machine, ends here; 0 where a text
// does not begin so.
std::size_t end_of_request(std::string_view text) {
  const std::size_t method = text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ");
  if (method == 0 || method == std::string_view::npos || !text.substr(method).starts_with(" /api/")) return 0;
  return std::min(text.find_first_of(" ?", method + 1), text.size());
}

// What broke work off may be the sentence of a driver: for a viewer that column of each row is struck, and no other,
// for those hold what people typed. The configuration is read on the thread that may change it.
auto seen_by(const ApiRequest& request, const LaserConfig& laser) {
  std::optional<LaserConfig> struck;
  if (request.caller.role < Role::kOperator) struck = laser;
  return [struck = std::move(struck)](Result<json> told, const char* rows, const char* column) {
    if (!told || !struck) return told;
    for (json& row : (*told)[rows]) {
      if (!row[column].is_string()) continue;
      const std::string text = row[column];
      const std::size_t end = end_of_request(text);
      json rest = text.substr(end);
      strike_places(rest, *struck);
      row[column] = text.substr(0, end) + rest.get<std::string>();
    }
    return told;
  };
}

}  // namespace

void bind_history_routes(Router& router, QueryPool& queries, const LaserConfig& laser) {
  router.bind("getAudit", [&queries, &laser](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    db::AuditFilter filter;
    filter.since = read_time(query, "since");
    filter.until = read_time(query, "until");
    filter.who = query.text("who").value_or("");
    filter.words = read_words(query);
    filter.kind = query.text("kind").value_or("");
    if (!filter.kind.empty() && !is_kind(filter.kind))
      query.refuse(
          {ErrorCode::kInvalidArgument, "there is no such kind: give the beginning of WHAT, as run, job or alarm"});
    if (const auto job = query.whole("job", {1, 9e15})) filter.job = JobId{*job};
    filter.panel = read_panel(query);
    if (page.after != 0) filter.before = page.after;
    if (const Status good = query.end(); !good) return reply(ApiReply::error(good.error()));
    reply_from_query(
        queries, request,
        [filter, page, seen = seen_by(request, laser)](Repositories& r) {
          return seen(audit_json(r, filter, page), "entries", "detail");
        },
        reply);
  });
  router.bind("getEventHistory", [&queries, &laser](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const int limit = static_cast<int>(query.whole("limit", {1, 1000}).value_or(Page{}.limit));
    const db::EventPlace after = read_place(query);
    db::EventFilter filter;
    filter.since = read_time(query, "since");
    filter.until = read_time(query, "until");
    filter.panel = read_panel(query);
    filter.kind = query.word("kind", db::kEventKinds).value_or("");
    if (const auto job = query.whole("job", {1, 9e15})) filter.job = JobId{*job};
    if (const auto piece = query.whole("piece", {1, 9e15})) filter.piece = PieceId{*piece};
    if (const Status good = query.end(); !good) return reply(ApiReply::error(good.error()));
    reply_from_query(
        queries, request,
        [filter, after, limit, seen = seen_by(request, laser)](Repositories& r) {
          return seen(events_json(r, filter, after, limit), "events", "what");
        },
        reply);
  });
  router.bind("getHistory", [&queries, &laser](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status good = query.end(); !good) return reply(ApiReply::error(good.error()));
    reply_from_query(
        queries, request,
        [page, seen = seen_by(request, laser)](Repositories& r) {
          return seen(history_json(r, page), "pieces", "run_result");
        },
        reply);
  });
  router.bind("getWoodHistory", [&queries](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status good = query.end(); !good) return reply(ApiReply::error(good.error()));
    reply_from_query(
        queries, request, [page](Repositories& r) { return wood_json(r, page); }, reply);
  });
}

}  // namespace veneer::daemon
