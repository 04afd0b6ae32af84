#include "db/remnant_book.h"

#include <fmt/format.h>

#include <cmath>

#include "db/panel_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

using Room = RemnantRecord::Room;

std::string written(const std::optional<Room>& room) {
  if (!room) return "[]";
  return fmt::format("[{},{},{}]", to_um(room->at.x), to_um(room->at.y),
                     static_cast<std::int64_t>(std::floor(room->size.count() * 1000)));
}

std::optional<Room> read_room(SQLite::Statement& row, int first) {
  if (row.getColumn(first).isNull()) return std::nullopt;
  return Room{{from_um(row.getColumn(first).getInt64()), from_um(row.getColumn(first + 1).getInt64())},
              from_um(row.getColumn(first + 2).getInt64())};
}

// As an object's text. SQLite writes it, so that any name is written as JSON has it.
template <class Entry>
std::string written(SQLite::Database& connection, const std::vector<Entry>& entries) {
  std::string out = "{}";
  SQLite::Statement set(connection, "SELECT json_patch(?, json_object(?, ?))");
  for (const auto& [name, area] : entries) {
    set.reset();
    SQLite::bind(set, out, name, to_um2(area));
    set.executeStep();
    out = text(set.getColumn(0));
  }
  return out;
}

template <class Entry>
std::vector<Entry> areas_of(SQLite::Database& connection, RemnantId remnant, const char* column) {
  SQLite::Statement rows(connection,
                         fmt::format("SELECT e.key, e.value FROM remnants AS m, json_each(m.{}) AS e WHERE m.id = ? "
                                     "ORDER BY e.id",
                                     column));
  rows.bind(1, remnant.value);
  std::vector<Entry> out;
  while (rows.executeStep())
    out.push_back(
        {text(rows.getColumn(0)), SquareMillimetres(static_cast<double>(rows.getColumn(1).getInt64()) * 1e-6)});
  return out;
}

}  // namespace

Status RemnantBook::book(const RemnantRecord& remnant) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement insert(connection,
                             "INSERT INTO remnants (panel, mask_version, counted_of, woods, square_um, circle_um, "
                             "fitting, picture_file, at, run) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    SQLite::bind(insert, remnant.panel.value, remnant.mask_version, remnant.counted_of,
                 written(connection, remnant.woods), written(remnant.square), written(remnant.circle),
                 written(connection, remnant.fitting), remnant.picture_file, remnant.at);
    if (remnant.run) insert.bind(10, remnant.run->value);
    insert.exec();
    return Ok();
  });
}

namespace {

std::vector<RemnantRecord> read(SQLite::Database& connection, const PanelId& panel, const char* which,
                                std::int64_t argument) {
  SQLite::Statement rows(connection,
                         fmt::format("SELECT id, mask_version, run, counted_of, picture_file, at, square_um ->> 0, "
                                     "square_um ->> 1, square_um ->> 2, circle_um ->> 0, circle_um ->> 1, circle_um "
                                     "->> 2 FROM remnants WHERE panel = ? {}",
                                     which));
  SQLite::bind(rows, panel.value, argument);
  std::vector<RemnantRecord> out;
  while (rows.executeStep()) {
    RemnantRecord& one = out.emplace_back();
    one.id = {rows.getColumn(0).getInt64()}, one.panel = panel, one.mask_version = rows.getColumn(1).getInt();
    if (!rows.getColumn(2).isNull()) one.run = RunId{rows.getColumn(2).getInt64()};
    one.counted_of = text(rows.getColumn(3)), one.picture_file = text(rows.getColumn(4));
    one.at = text(rows.getColumn(5));
    one.square = read_room(rows, 6), one.circle = read_room(rows, 9);
    one.woods = areas_of<RemnantRecord::Wood>(connection, one.id, "woods");
    one.fitting = areas_of<RemnantRecord::Fitting>(connection, one.id, "fitting");
  }
  return out;
}

}  // namespace

Result<RemnantRecord> RemnantBook::find(const PanelId& panel, RemnantId remnant) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<RemnantRecord> {
    auto found = read(connection, panel, "AND id = ?", remnant.value);
    if (found.empty())
      return Error{ErrorCode::kNotFound, fmt::format("panel {} has no remnant {}", panel.value, remnant.value)};
    return std::move(found.front());
  });
}

Result<std::vector<RemnantRecord>> RemnantBook::list(const PanelId& panel, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<RemnantRecord>> {
    return read(connection, panel, "ORDER BY id DESC LIMIT ?", limit);
  });
}

Result<std::optional<RemnantRecord>> RemnantBook::newest(const PanelId& panel) {
  auto found = list(panel, 1);
  if (!found.ok()) return found.error();
  return found->empty() ? std::nullopt : std::optional(std::move(found->front()));
}

Result<std::vector<RemnantBook::Due>> RemnantBook::due(int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<Due>> {
    SQLite::Statement rows(
        connection,
        fmt::format("SELECT p.id, n.run FROM panels AS p LEFT JOIN (SELECT panel, max(id) AS run FROM runs WHERE "
                    "ended_at IS NOT NULL GROUP BY panel) AS n ON n.panel = p.id LEFT JOIN (SELECT panel, max(run) AS "
                    "run, max(mask_version) AS mask FROM remnants GROUP BY panel) AS m ON m.panel = p.id WHERE {} AND "
                    "(coalesce(n.run, 0) > coalesce(m.run, 0) OR (SELECT max(version) FROM masks WHERE panel = p.id) > "
                    "coalesce(m.mask, 0)) ORDER BY coalesce(n.run, 0) DESC, p.number DESC LIMIT ?",
                    kIsInStock));
    rows.bind(1, limit);
    std::vector<Due> out;
    while (rows.executeStep()) {
      Due& due = out.emplace_back();
      due.panel = {text(rows.getColumn(0))};
      if (!rows.getColumn(1).isNull()) due.run = RunId{rows.getColumn(1).getInt64()};
    }
    return out;
  });
}

}  // namespace veneer::db
