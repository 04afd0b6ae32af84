// audit: who did what, newest first; and the comparison of its head with one that was written down.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include "cli/audit_log.h"
#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/text_table.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

struct AuditOptions {
  std::string since, until, who, text, kind, panel, job;
  std::int64_t limit = 50;
  bool all = false;
};

Result<json> read_audit(const ApiClient& client, const AuditOptions& options) {
  std::string query;
  const std::pair<const char*, const std::string&> filters[] = {
      {"since", options.since}, {"until", options.until}, {"who", options.who}, {"text", options.text},
      {"kind", options.kind},   {"panel", options.panel}, {"job", options.job}};
  for (const auto& [name, value] : filters)
    if (!value.empty()) query += fmt::format("&{}={}", name, url_encode(value));
  std::int64_t left = options.all ? std::numeric_limits<std::int64_t>::max() : options.limit;
  json whole;
  std::string cursor;
  while (left > 0) {
    const auto page = client.get(fmt::format("/audit?limit={}{}{}", std::min<std::int64_t>(left, 1000), cursor, query));
    if (!page) return page.error();
    const json& entries = member(*page, "entries");
    if (whole.is_null())
      whole = *page;
    else
      for (const json& row : entries) whole["entries"].push_back(row);
    whole["next"] = member(*page, "next");
    left -= static_cast<std::int64_t>(entries.size());
    if (!whole["next"].is_number_integer()) break;
    cursor = fmt::format("&cursor={}", whole["next"].get<std::int64_t>());
  }
  return whole;
}

}  // namespace

std::string render_audit(const json& audit) {
  TextTable table({">ROW", "WHEN", "WHO", "WHAT", "DETAIL"});
  for (const json& row : member(audit, "entries")) {
    // One line each: what a client sent may have several.
    std::string detail = text_or(row, "detail", "");
    std::ranges::replace_if(
        detail, [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
    table.add({std::to_string(whole_or(row, "id", 0)), text_or(row, "at", ""), text_or(row, "who", ""),
               text_or(row, "what", ""), detail});
  }
  std::string out = member(audit, "entries").empty() ? "Nothing like that is in the audit log.\n" : table.str();
  const json& head = member(audit, "head");
  if (const std::string hash = text_or(head, "hash", ""); !hash.empty())
    out +=
        fmt::format("\nHead of the log {}:{}\nWritten down elsewhere, `veneerctl db check --audit-head` compares it.\n",
                    whole_or(head, "id", 0), hash);
  return out;
}

Result<std::string> compare_audit_head(const ApiClient& client, const std::string& head) {
  const auto colon = head.find(':');
  std::int64_t number = 0;
  const auto digits = head.substr(0, colon);
  const bool usable = colon != std::string::npos && head.size() == colon + 65 && !digits.empty() &&
                      digits.size() < 16 && digits.find_first_not_of("0123456789") == std::string::npos;
  if (usable) number = std::stoll(digits);
  if (number == 0)
    return Error{ErrorCode::kInvalidArgument,
                 "--audit-head is not NUMBER:HASH: give it as `veneerctl audit` printed it"};
  const auto page = client.get(fmt::format("/audit?limit=1&cursor={}", number + 1));
  if (!page) return page.error();
  const json& rows = member(*page, "entries");
  const bool there = rows.is_array() && !rows.empty() && whole_or(rows[0], "id", 0) == number;
  if (!there || text_or(rows[0], "hash", "") != head.substr(colon + 1))
    return Error{
        ErrorCode::kStorage,
        fmt::format("the audit log is not the one of that head ({}): it was rewritten, or replaced by an older "
                    "one since; compare it with a backup of that time",
                    there ? fmt::format("row {} has another hash", number) : fmt::format("it has no row {}", number))};
  return fmt::format("The audit log goes on from row {} as it was written down; {} rows were added since.\n", number,
                     whole_or(member(*page, "head"), "id", number) - number);
}

void add_audit_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<AuditOptions>();
  CLI::App* command = app.add_subcommand("audit", "Who did what, newest first");
  command->add_option("--since", options->since, "From this time on, in UTC: 2026-05-01 or 2026-05-01T07:30");
  command->add_option("--until", options->until, "Before this time, in UTC");
  command->add_option("--text", options->text, "Only rows that have each of these words somewhere");
  command->add_option("--kind", options->kind, "Only kinds that begin with this: run, job, cell, alarm, api, laser");
  command->add_option("--job", options->job, "Only rows that name this job")->check(CLI::PositiveNumber);
  command->add_option("--who", options->who,
                      "Only what one user or program did, as the log names them: \"uid 1000\", veneerd");
  command->add_option("--panel", options->panel, "Only rows that name this panel");
  command->add_option("--limit", options->limit, "How many rows")->check(positive_number())->capture_default_str();
  command->add_flag("--all", options->all, "All rows, however many");
  command->callback([&context, options] { context.finish(read_audit(context.client(), *options), render_audit); });
}

}  // namespace veneer::cli
