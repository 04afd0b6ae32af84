#include "db/proposals.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "db/panel_sql.h"
#include "db/proposal_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

ProposalVerdict proposal_verdict_of(const std::string& name) {
  for (const auto verdict : {ProposalVerdict::kAccepted, ProposalVerdict::kReplaced})
    if (name == to_string(verdict)) return verdict;
  return ProposalVerdict::kRefused;  // the schema allows no fourth
}

std::string list_of(SQLite::Database& connection, const std::vector<std::string>& texts) {
  SQLite::Statement quoted(connection, "SELECT json_quote(?)");
  std::string out;
  for (const std::string& one : texts) {
    quoted.reset();
    quoted.bind(1, one);
    quoted.executeStep();
    out += (out.empty() ? "" : ",") + text(quoted.getColumn(0));
  }
  return "[" + out + "]";
}

std::vector<std::string> texts_in(SQLite::Database& connection, const std::string& list) {
  SQLite::Statement rows(connection, "SELECT value FROM json_each(?) ORDER BY id");
  rows.bind(1, list);
  std::vector<std::string> out;
  while (rows.executeStep()) out.push_back(text(rows.getColumn(0)));
  return out;
}

std::string list_of(const std::vector<int>& numbers) { return fmt::format("[{}]", fmt::join(numbers, ",")); }

constexpr const char* kProposalColumns =
    "SELECT p.id, p.panel, p.after, p.who, p.made_at, p.map_file, p.mask_file, p.read_file, p.read_sha256, "
    "p.scan_files, p.tags, p.width_um, p.height_um, p.usable_um2, p.lost_um2, p.gained_um2, p.warnings, v.verdict, "
    "v.overruled, v.panel, v.mask_version, v.who, v.note, v.at FROM proposals AS p LEFT JOIN proposal_verdicts AS v ON "
    "v.proposal = p.id ";

std::vector<AskedStripRecord> asked_of(SQLite::Database& connection, ProposalId proposal) {
  SQLite::Statement rows(connection,
                         "SELECT number, outline_um, confidence, taken, reason FROM asked_strips WHERE proposal = ? "
                         "ORDER BY number");
  rows.bind(1, proposal.value);
  std::vector<AskedStripRecord> out;
  while (rows.executeStep()) {
    const int number = rows.getColumn(0).getInt();
    const auto outline = read_ring(text(rows.getColumn(1)));
    if (!outline) throw damaged(fmt::format("the outline of strip {} of proposal {}", number, proposal.value));
    out.push_back({number, from_micro<PanelFrame>(*outline), rows.getColumn(2).getDouble(),
                   rows.getColumn(3).getInt() != 0, text(rows.getColumn(4))});
  }
  return out;
}

void insert_asked(SQLite::Database& connection, ProposalId proposal, const std::vector<AskedStripRecord>& asked) {
  SQLite::Statement insert(connection,
                           "INSERT INTO asked_strips (proposal, number, outline_um, confidence, taken, reason) VALUES "
                           "(?, ?, ?, ?, ?, ?)");
  for (const AskedStripRecord& strip : asked) {
    insert.reset();
    SQLite::bind(insert, proposal.value, strip.number, write_ring(to_micro(strip.outline)), strip.confidence,
                 strip.taken ? 1 : 0, strip.reason);
    insert.exec();
  }
}

ProposalRecord read(SQLite::Database& connection, SQLite::Statement& row) {
  ProposalRecord out;
  out.id = {row.getColumn(0).getInt64()};
  if (const auto panel = text_or_null(row.getColumn(1))) out.panel = PanelId{*panel};
  if (!row.getColumn(2).isNull()) out.after = row.getColumn(2).getInt();
  out.who = text(row.getColumn(3)), out.made_at = text(row.getColumn(4));
  out.map_file = text(row.getColumn(5)), out.mask_file = text(row.getColumn(6));
  out.read_file = text(row.getColumn(7)), out.read_sha256 = text(row.getColumn(8));
  out.scan_files = texts_in(connection, text(row.getColumn(9)));
  for (const std::string& tag : texts_in(connection, text(row.getColumn(10)))) out.tags.push_back(std::stoi(tag));
  out.width = from_um(row.getColumn(11).getInt64()), out.height = from_um(row.getColumn(12).getInt64());
  out.usable = from_um2(row.getColumn(13).getInt64());
  out.lost = from_um2(row.getColumn(14).getInt64()), out.gained = from_um2(row.getColumn(15).getInt64());
  out.warnings_json = text(row.getColumn(16));
  out.asked = asked_of(connection, out.id);
  if (row.getColumn(17).isNull()) return out;
  auto& decision = out.decision.emplace(ProposalRecord::Decision{});
  decision.verdict = proposal_verdict_of(text(row.getColumn(17)));
  decision.overruled = texts_in(connection, text(row.getColumn(18)));
  if (const auto panel = text_or_null(row.getColumn(19))) decision.panel = PanelId{*panel};
  if (!row.getColumn(20).isNull()) decision.mask_version = row.getColumn(20).getInt();
  decision.who = text(row.getColumn(21)), decision.note = text(row.getColumn(22)),
  decision.at = text(row.getColumn(23));
  return out;
}

struct Verdict {
  ProposalVerdict verdict = ProposalVerdict::kRefused;
  std::vector<std::string> overruled;
  std::optional<PanelId> panel;
  int mask_version = 0;
  std::string who, note, at;
};

void enter(SQLite::Database& connection, ProposalId proposal, const Verdict& verdict) {
  SQLite::Statement insert(connection,
                           "INSERT INTO proposal_verdicts (proposal, verdict, overruled, who, note, at, panel, "
                           "mask_version) VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, proposal.value, to_string(verdict.verdict), list_of(connection, verdict.overruled), verdict.who,
               verdict.note, verdict.at);
  if (verdict.panel) insert.bind(7, verdict.panel->value), insert.bind(8, verdict.mask_version);
  insert.exec();
}

Status check_open(SQLite::Database& connection, ProposalId proposal) {
  SQLite::Statement row(connection,
                        "SELECT v.verdict, v.at FROM proposals AS p LEFT JOIN proposal_verdicts AS v ON v.proposal = "
                        "p.id WHERE p.id = ?");
  row.bind(1, proposal.value);
  if (!row.executeStep())
    return Error{ErrorCode::kNotFound,
                 fmt::format("there is no proposal {}: see `veneerctl panel proposals --all`", proposal.value)};
  if (row.getColumn(0).isNull()) return Ok();
  const std::string verdict = text(row.getColumn(0));
  if (verdict == to_string(ProposalVerdict::kReplaced))
    return Error{
        ErrorCode::kConflict,
        fmt::format("a later scan took the place of proposal {}: see `veneerctl panel proposals`", proposal.value)};
  return Error{ErrorCode::kConflict, fmt::format("proposal {} was {} on {}: scan the sheet again", proposal.value,
                                                 verdict, text(row.getColumn(1)).substr(0, 10))};
}

// The same sheet was scanned again before anybody decided.
void replace_earlier(SQLite::Database& connection, const ProposalRecord& proposal) {
  SQLite::Statement open(connection,
                         "SELECT p.id FROM proposals AS p WHERE NOT EXISTS (SELECT 1 FROM proposal_verdicts WHERE "
                         "proposal = p.id) AND ((?1 IS NOT NULL AND p.panel IS ?1) OR (?1 IS NULL AND p.panel IS NULL "
                         "AND EXISTS (SELECT 1 FROM json_each(p.tags) AS t JOIN json_each(?2) AS n ON n.value = "
                         "t.value))) ORDER BY p.id");
  if (proposal.panel) open.bind(1, proposal.panel->value);
  open.bind(2, list_of(proposal.tags));
  std::vector<ProposalId> earlier;
  while (open.executeStep()) earlier.push_back({open.getColumn(0).getInt64()});
  for (const ProposalId id : earlier)
    enter(connection, id, {ProposalVerdict::kReplaced, {}, {}, 0, proposal.who, "", proposal.made_at});
}

}  // namespace

const char* to_string(ProposalVerdict verdict) {
  switch (verdict) {
    case ProposalVerdict::kAccepted:
      return "accepted";
    case ProposalVerdict::kRefused:
      return "refused";
    case ProposalVerdict::kReplaced:
      return "replaced";
  }
  return "refused";
}

Status accept(SQLite::Database& connection, const Acceptance& acceptance, const PanelId& panel, int mask_version,
              const std::string& at) {
  if (Status open = check_open(connection, acceptance.proposal); !open.ok()) return open;
  enter(connection, acceptance.proposal,
        {ProposalVerdict::kAccepted, acceptance.overruled, panel, mask_version, acceptance.who, "", at});
  return Ok();
}

Status check_decided(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement open(connection,
                         "SELECT p.id FROM proposals AS p WHERE p.panel = ? AND NOT EXISTS (SELECT 1 FROM "
                         "proposal_verdicts WHERE proposal = p.id) ORDER BY p.id DESC LIMIT 1");
  open.bind(1, panel.value);
  if (!open.executeStep()) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("a scan would change much of the wood of panel {0}, and nobody has decided: look at it with "
                           "`veneerctl panel proposals {1}`, then `panel accept {1}` or `panel refuse {1}`",
                           panel.value, open.getColumn(0).getInt64())};
}

Result<ProposalId> Proposals::add(const ProposalRecord& proposal) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<ProposalId> {
    if (proposal.panel && !panel_exists(connection, *proposal.panel)) return no_such_panel(*proposal.panel);
    replace_earlier(connection, proposal);
    SQLite::Statement insert(
        connection,
        "INSERT INTO proposals (who, made_at, map_file, mask_file, read_file, read_sha256, "
        "scan_files, tags, width_um, height_um, usable_um2, lost_um2, gained_um2, warnings, panel, "
        "after) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    SQLite::bind(insert, proposal.who, proposal.made_at, proposal.map_file, proposal.mask_file, proposal.read_file,
                 proposal.read_sha256, list_of(connection, proposal.scan_files), list_of(proposal.tags),
                 to_um(proposal.width), to_um(proposal.height), to_um2(proposal.usable), to_um2(proposal.lost),
                 to_um2(proposal.gained), proposal.warnings_json);
    if (proposal.panel) insert.bind(15, proposal.panel->value);
    if (proposal.after) insert.bind(16, *proposal.after);
    insert.exec();
    const ProposalId id{connection.getLastInsertRowid()};
    insert_asked(connection, id, proposal.asked);
    return id;
  });
}

Status Proposals::refuse(ProposalId proposal, const std::string& who, const std::string& note, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status open = check_open(connection, proposal); !open.ok()) return open;
    enter(connection, proposal, {ProposalVerdict::kRefused, {}, {}, 0, who, note, at});
    return Ok();
  });
}

Result<ProposalRecord> Proposals::find(ProposalId proposal) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<ProposalRecord> {
    SQLite::Statement row(connection, std::string(kProposalColumns) + "WHERE p.id = ?");
    row.bind(1, proposal.value);
    if (!row.executeStep())
      return Error{ErrorCode::kNotFound,
                   fmt::format("there is no proposal {}: see `veneerctl panel proposals --all`", proposal.value)};
    return read(connection, row);
  });
}

Result<std::vector<ProposalRecord>> Proposals::list(bool decided) { return list(decided, {}, -1); }

Result<std::vector<ProposalRecord>> Proposals::list(bool decided, ProposalId before, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<ProposalRecord>> {
    SQLite::Statement rows(
        connection, std::string(kProposalColumns) +
                        "WHERE (?1 OR v.proposal IS NULL) AND (?2 = 0 OR p.id < ?2) ORDER BY p.id DESC LIMIT ?3");
    SQLite::bind(rows, decided ? 1 : 0, before.value, limit);
    std::vector<ProposalRecord> out;
    while (rows.executeStep()) out.push_back(read(connection, rows));
    return out;
  });
}

Result<std::vector<std::string>> Proposals::spent_files() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<std::string>> {
    SQLite::Statement rows(
        connection,
        "WITH named (file, open) AS (SELECT f.file, v.proposal IS NULL FROM (SELECT id, map_file AS file FROM "
        "proposals "
        "UNION SELECT id, mask_file FROM proposals UNION SELECT id, read_file FROM proposals UNION SELECT p.id, "
        "e.value "
        "FROM proposals AS p, json_each(p.scan_files) AS e) AS f LEFT JOIN proposal_verdicts AS v ON v.proposal = "
        "f.id) "
        "SELECT file FROM named GROUP BY file HAVING max(open) = 0 AND file NOT IN (SELECT map_file FROM masks) AND "
        "file NOT IN (SELECT mask_file FROM masks) AND file NOT IN (SELECT file FROM scans) AND file NOT IN (SELECT "
        "seen_file FROM painted_masks) ORDER BY file");
    std::vector<std::string> out;
    while (rows.executeStep()) out.push_back(text(rows.getColumn(0)));
    return out;
  });
}

}  // namespace veneer::db
