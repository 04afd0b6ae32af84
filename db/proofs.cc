// Up to which piece of a run its panel was seen where it has to lie. The audit log has it, as a row for each such look:
//
//   run.proven   run 7 of job 3 on P-0001, 25 pieces cut before
#include <fmt/format.h>

#include <charconv>
#include <string_view>

#include "db/audit_chain.h"
#include "db/job_store.h"
#include "db/ledger_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kProven = "run.proven";
constexpr std::string_view kCutBefore = " pieces cut before";

// The steps by which a run booked its pieces: what a person says of one later is no such step.
constexpr const char* kBookings =
    "FROM runs AS r JOIN allocations AS a ON a.job = r.job AND a.panel = r.panel JOIN allocation_history AS h ON "
    "h.allocation = a.id AND h.run = r.id AND h.state = 'cut' WHERE r.id = ?1 AND (SELECT state FROM "
    "allocation_history WHERE allocation = a.id AND id < h.id ORDER BY id DESC LIMIT 1) = 'cutting' ";

// Of a row that note_proof() wrote; -1 of another one.
int pieces_cut_before(std::string_view detail) {
  const std::size_t end = detail.rfind(kCutBefore), comma = detail.rfind(", ");
  int out = -1;
  if (end == std::string_view::npos || comma == std::string_view::npos || comma + 2 >= end) return out;
  const auto read = std::from_chars(detail.data() + comma + 2, detail.data() + end, out);
  return read.ec == std::errc() && read.ptr == detail.data() + end ? out : -1;
}

}  // namespace

Status JobStore::note_proof(RunId run, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement of(connection, "SELECT job, panel FROM runs WHERE id = ?");
    of.bind(1, run.value);
    if (!of.executeStep()) return Error{ErrorCode::kNotFound, fmt::format("there is no run {}", run.value)};
    SQLite::Statement booked(connection, std::string("SELECT count(*) ") + kBookings);
    booked.bind(1, run.value);
    booked.executeStep();
    append_to_chain(connection, {0, at, kDaemon, kProven,
                                 fmt::format("run {} of job {} on {}, {}{}", run.value, of.getColumn(0).getInt64(),
                                             text(of.getColumn(1)), booked.getColumn(0).getInt(), kCutBefore)});
    return Ok();
  });
}

Result<std::optional<UnprovenCuts>> JobStore::unproven() {
  auto run = last_run();
  if (!run) return run.error();
  if (!*run) return std::optional<UnprovenCuts>();
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<UnprovenCuts>> {
    // Reading stops where the run began. What an earlier one owed may have been proven since.
    SQLite::Statement noted(
        connection,
        "SELECT detail FROM audit WHERE what IN ('run.start', 'run.proven') AND detail LIKE ? ORDER "
        "BY id DESC LIMIT 1");
    noted.bind(1, fmt::format("run {} of job %", (*run)->id.value));
    if (!noted.executeStep()) return std::optional<UnprovenCuts>();
    const int proven = pieces_cut_before(text(noted.getColumn(0)));
    if (proven < 0) return std::optional<UnprovenCuts>();
    SQLite::Statement rows(connection, std::string("SELECT a.piece, a.state = 'cut' AND h.id = (SELECT max(id) FROM "
                                                   "allocation_history WHERE allocation = a.id) ") +
                                           kBookings + "ORDER BY h.id LIMIT -1 OFFSET ?2");
    SQLite::bind(rows, (*run)->id.value, proven);
    UnprovenCuts out{std::move(**run), {}};
    while (rows.executeStep())
      if (rows.getColumn(1).getInt() != 0) out.pieces.push_back({rows.getColumn(0).getInt64()});
    return out.pieces.empty() ? std::optional<UnprovenCuts>() : std::optional(std::move(out));
  });
}

}  // namespace veneer::db
