// Who did what, and what became of every piece: both page by page, however long they have become.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

#include "daemon/api/page.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"

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

// "P-0001". Whatever else stands there would be read as a pattern: it would find other panels' rows, and take its time.
bool is_panel_name(std::string_view text) {
  return text.size() > 2 && text.size() <= 20 && text.starts_with("P-") &&
         std::ranges::all_of(text.substr(2), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

void bind_history_routes(Router& router, QueryPool& queries) {
  router.bind("getAudit", [&queries](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    db::AuditFilter filter;
    if (const auto since = query.text("since")) {
      const auto begin = beginning_of_time(*since);
      if (!begin)
        query.refuse(
            {ErrorCode::kInvalidArgument, "since is no time: give it in UTC, as 2026-05-01 or 2026-05-01T07:30:00Z"});
      filter.since = begin.value_or("");
    }
    filter.who = query.text("who").value_or("");
    if (const auto panel = query.text("panel")) {
      if (!is_panel_name(*panel))
        query.refuse({ErrorCode::kInvalidArgument, "panel is no panel's name: give it as on its label, as P-0001"});
      filter.panel = PanelId{*panel};
    }
    if (page.after != 0) filter.before = page.after;
    if (const Status good = query.end(); !good) return reply(ApiReply::error(good.error()));
    reply_from_query(
        queries, request, [filter, page](Repositories& r) { return audit_json(r, filter, page); }, reply);
  });
  router.bind("getHistory", [&queries](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status good = query.end(); !good) return reply(ApiReply::error(good.error()));
    reply_from_query(
        queries, request, [page](Repositories& r) { return history_json(r, page); }, reply);
  });
}

}  // namespace veneer::daemon
