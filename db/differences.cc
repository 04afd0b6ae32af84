#include "db/differences.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "db/difference_sql.h"
#include "db/ledger_sql.h"
#include "db/panel_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kGone = "gone_not_booked";
constexpr const char* kStillThere = "booked_not_gone";

DifferenceVerdict difference_verdict_of(const std::string& name) {
  for (const auto verdict : {DifferenceVerdict::kWrittenOff, DifferenceVerdict::kAccepted, DifferenceVerdict::kGrown})
    if (name == to_string(verdict)) return verdict;
  return DifferenceVerdict::kNotSeenAgain;  // the schema allows no fifth
}

// A difference and the box around it, which is asked about often.
struct SeenDifference {
  const DifferenceRecord* record;
  Box<PanelFrame> box;
  explicit SeenDifference(const DifferenceRecord& of) : record(&of), box(bounds_of(of.shape)) {}
};

bool meet(const SeenDifference& a, const SeenDifference& b) {
  return a.record->gone == b.record->gone && a.box.min.x <= b.box.max.x && b.box.min.x <= a.box.max.x &&
         a.box.min.y <= b.box.max.y && b.box.min.y <= a.box.max.y && overlaps(a.record->shape, b.record->shape);
}

// How much the two share when what was seen now is what was seen before, else nothing. Two scans show one border a
// little differently; but what is seen now is no part of something large that is not there any more.
SquareMillimetres shared_when_same(const SeenDifference& before, const SeenDifference& now) {
  constexpr Millimetres kBorder{0.3}, kFarthest{1};
  const SquareMillimetres none{0};
  if (!meet(before, now) || now.record->area.count() > 1.2 * before.record->area.count() + 2) return none;
  const auto &was = before.record->shape, &is = now.record->shape;
  const auto mostly_in = [&](const Region<PanelFrame>& part, const Region<PanelFrame>& whole) {
    return intersect(part, offset(whole, kBorder)).area().count() >= 0.5 * part.area().count();
  };
  const bool reaches_out = overlaps(is, subtract(is, offset(was, kFarthest)));
  if (reaches_out || !mostly_in(is, was) || !mostly_in(was, is)) return none;
  return intersect(was, is).area();
}

struct Matches {
  std::vector<bool> before, now;  // is it the same as one of the others?
};
// One to one, those that share most first.
Matches match(const std::vector<SeenDifference>& before, const std::vector<SeenDifference>& now) {
  struct Pair {
    double shared;
    std::size_t before, now;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < before.size(); ++i)
    for (std::size_t j = 0; j < now.size(); ++j)
      if (const auto shared = shared_when_same(before[i], now[j]); shared.count() > 0)
        pairs.push_back({shared.count(), i, j});
  std::ranges::stable_sort(pairs, std::ranges::greater(), &Pair::shared);
  Matches out{std::vector<bool>(before.size()), std::vector<bool>(now.size())};
  for (const Pair& pair : pairs)
    if (!out.before[pair.before] && !out.now[pair.now]) out.before[pair.before] = out.now[pair.now] = true;
  return out;
}

// `which` follows "WHERE d.panel = ?".
std::vector<DifferenceRecord> read(SQLite::Database& connection, const PanelId& panel, const std::string& which,
                                   int limit = -1) {
  SQLite::Statement rows(connection,
                         "SELECT d.id, d.kind, d.place_um, d.shape_um, d.area_um2, d.pieces, d.found_at, v.verdict, "
                         "v.who, v.note, v.at FROM differences AS d LEFT JOIN difference_verdicts AS v ON v.id = "
                         "(SELECT max(id) FROM difference_verdicts WHERE difference = d.id) WHERE d.panel = ? " +
                             which + fmt::format(" LIMIT {}", limit));
  rows.bind(1, panel.value);
  std::vector<DifferenceRecord> out;
  while (rows.executeStep()) {
    DifferenceRecord& difference = out.emplace_back();
    difference.id = {rows.getColumn(0).getInt64()};
    difference.gone = text(rows.getColumn(1)) == kGone;
    const auto place = read_ring(text(rows.getColumn(2)));
    auto shape = read_area(text(rows.getColumn(3)));
    if (!place || place->size() != 1 || !shape || shape->empty())
      throw damaged(fmt::format("difference {} of panel {}", difference.id.value, panel.value));
    difference.place = from_micro<PanelFrame>(*place).front();
    difference.shape = Region<PanelFrame>(std::move(*shape));
    difference.area = SquareMillimetres(static_cast<double>(rows.getColumn(4).getInt64()) * 1e-6);
    difference.pieces_json = text(rows.getColumn(5));
    difference.found_at = text(rows.getColumn(6));
    if (!rows.getColumn(7).isNull())
      difference.decision =
          DifferenceRecord::Decision{difference_verdict_of(text(rows.getColumn(7))), text(rows.getColumn(8)),
                                     text(rows.getColumn(9)), text(rows.getColumn(10))};
  }
  return out;
}

void enter_verdict(SQLite::Database& connection, DifferenceId difference, DifferenceVerdict verdict,
                   const std::string& who, const std::string& note, const std::string& at) {
  SQLite::Statement insert(
      connection, "INSERT INTO difference_verdicts (difference, verdict, who, note, at) VALUES (?, ?, ?, ?, ?)");
  SQLite::bind(insert, difference.value, to_string(verdict), who, note, at);
  insert.exec();
}

void enter(SQLite::Database& connection, const PanelId& panel, const DifferenceRecord& difference,
           const std::string& at) {
  SQLite::Statement insert(
      connection,
      "INSERT INTO differences (panel, kind, place_um, shape_um, area_um2, pieces, found_at) VALUES "
      "(?, ?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, panel.value, difference.gone ? kGone : kStillThere,
               write_ring(to_micro(std::vector{difference.place})), write_area(difference.shape.micro_area()),
               to_um2(difference.area), difference.pieces_json, at);
  insert.exec();
}

// When the first scan after that of `version` was looked at; later than all where there is none. A version that was
// painted on, or that took an earlier one back, is no scan.
std::string next_scan_at(SQLite::Database& connection, const PanelId& panel, int version) {
  SQLite::Statement row(
      connection,
      "WITH seen AS (SELECT m.version, m.made_at, m.map_file || ' ' || coalesce(t.seen_file, m.mask_file) AS files "
      "FROM masks AS m LEFT JOIN painted_masks AS t ON t.panel = m.panel AND t.version = m.version WHERE m.panel = "
      "?1), "
      "scanned AS (SELECT min(version) AS version, made_at, files FROM seen GROUP BY files) "
      "SELECT s.made_at FROM scanned AS s WHERE s.version > (SELECT f.version FROM scanned AS f JOIN seen AS v ON "
      "v.files = f.files WHERE v.version = ?2) ORDER BY s.version LIMIT 1");
  SQLite::bind(row, panel.value, version);
  return row.executeStep() ? text(row.getColumn(0)) : "9999";
}

bool by_a_scan(DifferenceVerdict verdict) {
  return verdict == DifferenceVerdict::kNotSeenAgain || verdict == DifferenceVerdict::kGrown;
}

struct TakenBack {
  std::vector<DifferenceRecord> closed, opened, open;  // opened: they were closed by later scans only
};
TakenBack taken_back(SQLite::Database& connection, const PanelId& panel, int version) {
  const std::string next = next_scan_at(connection, panel, version);
  TakenBack out;
  const auto all = read(connection, panel, "ORDER BY d.id");
  for (std::size_t i = 0; i < all.size(); ++i) {
    const DifferenceRecord& one = all[i];
    if (one.found_at >= next) {
      if (!one.decision) out.closed.push_back(one);
      continue;
    }
    if (!one.decision) {
      out.open.push_back(one);
      continue;
    }
    // Entered anew when it was opened before.
    const bool again = std::any_of(all.begin() + static_cast<std::ptrdiff_t>(i) + 1, all.end(), [&](const auto& later) {
      return later.found_at == one.found_at && later.gone == one.gone &&
             later.shape.micro_area().rings == one.shape.micro_area().rings;
    });
    const bool person = !one.decision->who.empty();
    if (again || !by_a_scan(one.decision->verdict) || (!person && one.decision->at < next)) continue;
    out.opened.push_back(one);
  }
  return out;
}

// What of the shape is wood of the panel.
Region<PanelFrame> within(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& shape) {
  SQLite::Statement size(connection, "SELECT width_um, height_um FROM panels WHERE id = ?");
  size.bind(1, panel.value);
  size.executeStep();
  constexpr Millimetres kZero{0};
  const Millimetres width = from_um(size.getColumn(0).getInt64()), height = from_um(size.getColumn(1).getInt64());
  return intersect(
      shape, Region<PanelFrame>(Ring<PanelFrame>{{kZero, kZero}, {width, kZero}, {width, height}, {kZero, height}}));
}

// Pieces that were to be cut from wood that is gone: somebody has to say what becomes of them.
std::vector<PieceId> doubt_reserved(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                                    const std::string& at) {
  SQLite::Statement rows(connection, "SELECT piece, area_um FROM allocations WHERE panel = ? AND state = 'reserved'");
  rows.bind(1, panel.value);
  std::vector<PieceId> out;
  while (rows.executeStep()) {
    const auto reserved = read_area(text(rows.getColumn(1)));
    if (!reserved) throw damaged("an allocation of panel " + panel.value);
    if (overlaps(Region<PanelFrame>(*reserved), area)) out.push_back({rows.getColumn(0).getInt64()});
  }
  for (const PieceId piece : out)
    move_piece(connection, piece, AllocationState::kReserved, AllocationState::kSuspect, at);
  return out;
}

}  // namespace

void take_back(SQLite::Database& connection, const PanelId& panel, int version, const std::string& who,
               const std::string& at) {
  const TakenBack back = taken_back(connection, panel, version);
  for (const auto& difference : back.closed)
    enter_verdict(connection, difference.id, DifferenceVerdict::kNotSeenAgain, who,
                  "the scan that found it was taken back", at);
  for (const auto& difference : back.opened) enter(connection, panel, difference, difference.found_at);
}

const char* to_string(DifferenceVerdict verdict) {
  switch (verdict) {
    case DifferenceVerdict::kWrittenOff:
      return "written_off";
    case DifferenceVerdict::kAccepted:
      return "accepted";
    case DifferenceVerdict::kNotSeenAgain:
      return "not_seen_again";
    case DifferenceVerdict::kGrown:
      return "grown";
  }
  return "not_seen_again";
}

Status Differences::found(const PanelId& panel, const std::vector<DifferenceRecord>& differences, const std::string& at,
                          bool later_map) {
  for (const DifferenceRecord& seen : differences)
    if (seen.shape.empty())
      return Error{ErrorCode::kInvalidArgument, "a difference has no outline: scan the panel again"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    const auto known = read(connection, panel, "AND (v.verdict IS NULL OR v.verdict = 'accepted') ORDER BY d.id");
    const std::vector<SeenDifference> before(known.begin(), known.end()), now(differences.begin(), differences.end());
    const Matches same = match(before, now);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (same.before[i] || (later_map && known[i].gone)) continue;
      bool grown = false;
      for (std::size_t j = 0; j < now.size() && !grown; ++j)
        grown = !same.now[j] && now[j].record->area > known[i].area && meet(before[i], now[j]);
      enter_verdict(connection, known[i].id, grown ? DifferenceVerdict::kGrown : DifferenceVerdict::kNotSeenAgain, "",
                    "", at);
    }
    for (std::size_t j = 0; j < now.size(); ++j)
      if (!same.now[j]) enter(connection, panel, differences[j], at);
    return Ok();
  });
}

Result<std::vector<PieceId>> Differences::decide(const PanelId& panel, DifferenceId difference,
                                                 DifferenceVerdict verdict, const std::string& who,
                                                 const std::string& note, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PieceId>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    const auto known = read(connection, panel, fmt::format("AND d.id = {}", difference.value));
    if (known.empty())
      return Error{ErrorCode::kNotFound,
                   fmt::format("panel {0} has no difference {1}: see `veneerctl panel differences "
                               "{0}`",
                               panel.value, difference.value)};
    if (known.front().decision)
      return Error{ErrorCode::kConflict, fmt::format("difference {} was decided before, at {}", difference.value,
                                                     known.front().decision->at)};
    std::vector<PieceId> doubtful;
    if (verdict == DifferenceVerdict::kWrittenOff) {
      if (!known.front().gone)
        return Error{ErrorCode::kInvalidArgument,
                     "this wood is booked as cut already: accept the difference, and have the piece made again with "
                     "`veneerctl job redo JOB PIECE --lost` if it is lost"};
      if (connection.execAndGet("SELECT count(*) FROM runs WHERE ended_at IS NULL").getInt() != 0)
        return Error{ErrorCode::kConflict, "a panel is being cut: write wood off when that is done"};
      const auto gone = within(connection, panel, known.front().shape);
      doubtful = doubt_reserved(connection, panel, gone, at);
      write_off_free(connection, panel, gone, fmt::format("difference {}: gone, and not booked", difference.value), at);
    }
    enter_verdict(connection, difference, verdict, who, note, at);
    return doubtful;
  });
}

Result<std::vector<DifferenceRecord>> Differences::of(const PanelId& panel) { return of(panel, {}, -1); }

Result<std::vector<DifferenceRecord>> Differences::of(const PanelId& panel, DifferenceId before, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<DifferenceRecord>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    const std::string older = before.value == 0 ? "" : fmt::format("AND d.id < {} ", before.value);
    return read(connection, panel, older + "ORDER BY d.id DESC", limit);
  });
}

Result<std::vector<DifferenceRecord>> Differences::open_after(const PanelId& panel, int version) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<DifferenceRecord>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    auto out = taken_back(connection, panel, version);
    out.open.insert(out.open.end(), out.opened.begin(), out.opened.end());
    return std::move(out.open);
  });
}

}  // namespace veneer::db
