#include "db/differences.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "db/ledger_sql.h"
#include "db/panel_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kGone = "gone_not_booked";
constexpr const char* kStillThere = "booked_not_gone";

DifferenceVerdict verdict_of(const std::string& name) {
  for (const auto verdict : {DifferenceVerdict::kWrittenOff, DifferenceVerdict::kAccepted, DifferenceVerdict::kGrown})
    if (name == to_string(verdict)) return verdict;
  return DifferenceVerdict::kNotSeenAgain;  // the schema allows no fifth
}

Ring<PanelFrame> ring_of(const Box<PanelFrame>& box) {
  return {box.min, {box.max.x, box.min.y}, box.max, {box.min.x, box.max.y}};
}

bool meet(const Box<PanelFrame>& a, const Box<PanelFrame>& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y;
}

bool meet(const DifferenceRecord& a, const DifferenceRecord& b) { return a.gone == b.gone && meet(a.box, b.box); }

// What was seen now is what was seen before: two scans show one border a little differently.
bool same(const DifferenceRecord& before, const DifferenceRecord& now) {
  constexpr Millimetres kBorder{1};
  const bool within = now.box.min.x >= before.box.min.x - kBorder && now.box.min.y >= before.box.min.y - kBorder &&
                      now.box.max.x <= before.box.max.x + kBorder && now.box.max.y <= before.box.max.y + kBorder;
  return before.gone == now.gone && within && now.area.count() <= 1.2 * before.area.count() + 2;
}

// `which` follows "WHERE d.panel = ?".
std::vector<DifferenceRecord> read(SQLite::Database& connection, const PanelId& panel, const std::string& which) {
  SQLite::Statement rows(connection,
                         "SELECT d.id, d.kind, d.place_um, d.box_um, d.area_um2, d.pieces, d.found_at, v.verdict, "
                         "v.who, v.note, v.at FROM differences AS d LEFT JOIN difference_verdicts AS v ON "
                         "v.difference = d.id WHERE d.panel = ? " +
                             which);
  rows.bind(1, panel.value);
  std::vector<DifferenceRecord> out;
  while (rows.executeStep()) {
    DifferenceRecord& difference = out.emplace_back();
    difference.id = {rows.getColumn(0).getInt64()};
    difference.gone = text(rows.getColumn(1)) == kGone;
    const auto place = read_ring(text(rows.getColumn(2))), box = read_ring(text(rows.getColumn(3)));
    if (!place || place->size() != 1 || !box || box->empty())
      throw damaged(fmt::format("difference {} of panel {}", difference.id.value, panel.value));
    difference.place = from_micro<PanelFrame>(*place).front();
    difference.box = bounds(from_micro<PanelFrame>(*box));
    difference.area = SquareMillimetres(static_cast<double>(rows.getColumn(4).getInt64()) * 1e-6);
    difference.pieces_json = text(rows.getColumn(5));
    difference.found_at = text(rows.getColumn(6));
    if (!rows.getColumn(7).isNull())
      difference.decision = DifferenceRecord::Decision{verdict_of(text(rows.getColumn(7))), text(rows.getColumn(8)),
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
  SQLite::Statement insert(connection,
                           "INSERT INTO differences (panel, kind, place_um, box_um, area_um2, pieces, found_at) VALUES "
                           "(?, ?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, panel.value, difference.gone ? kGone : kStillThere,
               write_ring(to_micro(std::vector{difference.place})), write_ring(to_micro(ring_of(difference.box))),
               static_cast<std::int64_t>(std::llround(difference.area.count() * 1e6)), difference.pieces_json, at);
  insert.exec();
}

// What of the box is wood of the panel.
Region<PanelFrame> within(SQLite::Database& connection, const PanelId& panel, const Box<PanelFrame>& box) {
  SQLite::Statement size(connection, "SELECT width_um, height_um FROM panels WHERE id = ?");
  size.bind(1, panel.value);
  size.executeStep();
  const Box<PanelFrame> sheet{{}, {from_um(size.getColumn(0).getInt64()), from_um(size.getColumn(1).getInt64())}};
  return intersect(Region<PanelFrame>(ring_of(box)), Region<PanelFrame>(ring_of(sheet)));
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

Status Differences::found(const PanelId& panel, const std::vector<DifferenceRecord>& differences,
                          const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    const auto open = read(connection, panel, "AND v.verdict IS NULL");
    const auto accepted = read(connection, panel, "AND v.verdict = 'accepted'");
    const auto known = [&](const DifferenceRecord& seen) {
      const auto is_it = [&](const DifferenceRecord& before) { return same(before, seen); };
      return std::ranges::any_of(open, is_it) || std::ranges::any_of(accepted, is_it);
    };
    std::vector<DifferenceRecord> fresh;
    std::ranges::copy_if(differences, std::back_inserter(fresh), [&](const auto& seen) { return !known(seen); });
    for (const DifferenceRecord& before : open) {
      if (std::ranges::any_of(differences, [&](const auto& seen) { return same(before, seen); })) continue;
      const bool grown = std::ranges::any_of(fresh, [&](const auto& seen) { return meet(before, seen); });
      enter_verdict(connection, before.id, grown ? DifferenceVerdict::kGrown : DifferenceVerdict::kNotSeenAgain, "", "",
                    at);
    }
    for (const DifferenceRecord& seen : fresh) enter(connection, panel, seen, at);
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
                     "`veneerctl job redo` if it is lost"};
      if (connection.execAndGet("SELECT count(*) FROM runs WHERE ended_at IS NULL").getInt() != 0)
        return Error{ErrorCode::kConflict, "a panel is being cut: write wood off when that is done"};
      const auto box = within(connection, panel, known.front().box);
      doubtful = doubt_reserved(connection, panel, box, at);
      write_off_free(connection, panel, box, fmt::format("difference {}: gone, and not booked", difference.value), at);
    }
    enter_verdict(connection, difference, verdict, who, note, at);
    return doubtful;
  });
}

Result<std::vector<DifferenceRecord>> Differences::of(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<DifferenceRecord>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    return read(connection, panel, "ORDER BY d.id DESC");
  });
}

Result<int> Differences::open(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<int> {
    SQLite::Statement row(connection,
                          "SELECT count(*) FROM differences AS d WHERE d.panel = ? AND NOT EXISTS (SELECT 1 FROM "
                          "difference_verdicts WHERE difference = d.id)");
    row.bind(1, panel.value);
    row.executeStep();
    return row.getColumn(0).getInt();
  });
}

}  // namespace veneer::db
