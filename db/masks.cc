#include "db/masks.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <utility>

#include "db/audit_chain.h"
#include "db/difference_sql.h"
#include "db/panel_sql.h"
#include "db/proposal_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kGive = "give";

int newest_mask(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement row(connection, "SELECT coalesce(max(version), 0) FROM masks WHERE panel = ?");
  row.bind(1, panel.value);
  row.executeStep();
  return row.getColumn(0).getInt();
}

// The number that the mask gets, made from what counted as version `after`.
Result<int> enter_version(SQLite::Database& connection, const PanelId& panel, const MaskRecord& mask, int after) {
  if (!panel_exists(connection, panel)) return no_such_panel(panel);
  if (is_retired(connection, panel)) return retired_meanwhile(panel);
  MaskRecord added = mask;
  added.version = newest_mask(connection, panel) + 1;
  if (added.version != after + 1)
    return Error{ErrorCode::kConflict,
                 fmt::format("the mask of panel {} was changed while this was looked at: look again, and scan it again "
                             "if this was a scan",
                             panel.value)};
  insert_mask(connection, panel, added);
  return added.version;
}

constexpr const char* kMaskColumns =
    "m.version, m.map_file, m.mask_file, m.map_hash, m.made_at, a.usable_um2, coalesce(t.seen_file, m.mask_file) FROM "
    "masks AS m LEFT JOIN mask_areas AS a ON a.panel = m.panel AND a.version = m.version LEFT JOIN painted_masks AS t "
    "ON t.panel = m.panel AND t.version = m.version ";

MaskRecord read_mask(SQLite::Statement& row) {
  return {row.getColumn(0).getInt(), text(row.getColumn(1)),         text(row.getColumn(2)), text(row.getColumn(3)),
          text(row.getColumn(4)),    area_or_null(row.getColumn(5)), text(row.getColumn(6))};
}

constexpr const char* kEditColumns =
    "SELECT e.id, e.kind, e.shape_um, e.who, e.note, e.at, r.who, r.at FROM mask_edits AS e LEFT JOIN "
    "mask_edit_removals AS r ON r.edit = e.id WHERE e.panel = ?1 ";

MaskEdit read_edit(SQLite::Statement& row, const PanelId& panel) {
  MaskEdit edit;
  edit.id = {row.getColumn(0).getInt64()};
  edit.give = text(row.getColumn(1)) == kGive;
  auto shape = read_area(text(row.getColumn(2)));
  if (!shape || shape->empty()) throw damaged(fmt::format("edit {} of the mask of {}", edit.id.value, panel.value));
  edit.shape = Region<PanelFrame>(std::move(*shape));
  edit.who = text(row.getColumn(3)), edit.note = text(row.getColumn(4)), edit.at = text(row.getColumn(5));
  if (!row.getColumn(6).isNull()) edit.removal = MaskEdit::Removal{text(row.getColumn(6)), text(row.getColumn(7))};
  return edit;
}

Error no_such_edit(const PanelId& panel, MaskEditId edit) {
  return {ErrorCode::kNotFound,
          fmt::format("panel {0} has no edit {1}: see `veneerctl panel mask {0} --list`", panel.value, edit.value)};
}

std::optional<MaskEdit> edit_of(SQLite::Database& connection, const PanelId& panel, MaskEditId edit) {
  SQLite::Statement row(connection, fmt::format("{}AND e.id = ?2", kEditColumns));
  SQLite::bind(row, panel.value, edit.value);
  return row.executeStep() ? std::optional(read_edit(row, panel)) : std::nullopt;
}

// ", 12.5 mm2 more usable", of a version after the one before; nothing where one of them was never measured.
std::string change_words(SQLite::Database& connection, const PanelId& panel, int version) {
  SQLite::Statement row(connection,
                        "SELECT now.usable_um2 - before.usable_um2 FROM mask_areas AS now JOIN mask_areas AS before ON "
                        "before.panel = now.panel AND before.version = now.version - 1 WHERE now.panel = ? AND "
                        "now.version = ?");
  SQLite::bind(row, panel.value, version);
  if (!row.executeStep()) return "";
  const double mm2 = from_um2(row.getColumn(0).getInt64()).count();
  return fmt::format(", {:.2f} mm2 {} usable", std::abs(mm2), mm2 < 0 ? "less" : "more");
}

// As it was entered, of its panel and version.
std::optional<MaskRecord> version_of(SQLite::Database& connection, const PanelId& panel, int version) {
  SQLite::Statement row(
      connection,
      "SELECT m.map_file, coalesce(t.seen_file, m.mask_file), m.map_hash, CASE WHEN t.seen_file IS NULL THEN "
      "a.usable_um2 END FROM masks AS m LEFT JOIN mask_areas AS a ON a.panel = m.panel AND a.version = m.version LEFT "
      "JOIN painted_masks AS t ON t.panel = m.panel AND t.version = m.version WHERE m.panel = ? AND m.version = ?");
  SQLite::bind(row, panel.value, version);
  if (!row.executeStep()) return std::nullopt;
  return MaskRecord{0,  text(row.getColumn(0)),        text(row.getColumn(1)), text(row.getColumn(2)),
                    "", area_or_null(row.getColumn(3))};
}

}  // namespace

std::optional<SquareMillimetres> area_or_null(const SQLite::Column& um2) {
  if (um2.isNull()) return std::nullopt;
  return from_um2(um2.getInt64());
}

void insert_mask(SQLite::Database& connection, const PanelId& panel, const MaskRecord& mask) {
  SQLite::Statement insert(
      connection,
      "INSERT INTO masks (panel, version, map_file, mask_file, map_hash, made_at) VALUES (?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, panel.value, mask.version, mask.map_file, mask.mask_file, mask.map_hash, mask.made_at);
  insert.exec();
  if (!mask.seen_file.empty() && mask.seen_file != mask.mask_file) {
    SQLite::Statement painted(connection, "INSERT INTO painted_masks (panel, version, seen_file) VALUES (?, ?, ?)");
    SQLite::bind(painted, panel.value, mask.version, mask.seen_file);
    painted.exec();
  }
  if (!mask.usable) return;
  SQLite::Statement area(connection, "INSERT INTO mask_areas (panel, version, usable_um2) VALUES (?, ?, ?)");
  SQLite::bind(area, panel.value, mask.version, to_um2(*mask.usable));
  area.exec();
}

Result<int> Panels::add_mask(const PanelId& panel, const MaskRecord& mask, int after,
                             const std::optional<Acceptance>& of) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<int> {
    auto version = enter_version(connection, panel, mask, after);
    if (!version.ok() || !of) return version;
    if (Status accepted = accept(connection, *of, panel, *version, mask.made_at); !accepted.ok())
      return accepted.error();
    return version;
  });
}

Result<std::vector<MaskRecord>> Panels::masks(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<MaskRecord>> {
    SQLite::Statement rows(connection, fmt::format("SELECT {}WHERE m.panel = ? ORDER BY m.version DESC", kMaskColumns));
    rows.bind(1, panel.value);
    std::vector<MaskRecord> out;
    while (rows.executeStep()) out.push_back(read_mask(rows));
    return out;
  });
}

Result<std::vector<ListedMask>> Panels::masks(const PanelId& panel, int before, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<ListedMask>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    SQLite::Statement rows(
        connection, fmt::format("SELECT {}WHERE m.panel = ?1 AND (?2 = 0 OR m.version < ?2) ORDER BY m.version DESC "
                                "LIMIT ?3",
                                kMaskColumns));
    SQLite::Statement first(connection,
                            "SELECT min(version) FROM masks WHERE panel = ? AND map_file = ? AND mask_file = ?");
    SQLite::bind(rows, panel.value, before, limit);
    std::vector<ListedMask> out;
    while (rows.executeStep()) {
      ListedMask& listed = out.emplace_back(ListedMask{read_mask(rows), 0});
      first.reset();
      SQLite::bind(first, panel.value, listed.mask.map_file, listed.mask.mask_file);
      first.executeStep();
      listed.first = first.getColumn(0).getInt();
    }
    return out;
  });
}

Result<int> Panels::revert_mask(const PanelId& panel, int version, const std::string& at, const std::string& who,
                                const std::optional<Painted>& painted) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<int> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    const int newest = newest_mask(connection, panel);
    if (version == newest)
      return Error{ErrorCode::kConflict,
                   fmt::format("version {} of panel {} is the one that counts already", version, panel.value)};
    auto again = version_of(connection, panel, version);
    if (!again)
      return Error{ErrorCode::kNotFound, fmt::format("panel {} has no version {}: see `veneerctl panel scans {}`",
                                                     panel.value, version, panel.value)};
    if (painted && painted->after != newest)
      return Error{ErrorCode::kConflict,
                   fmt::format("the mask of panel {} was changed meanwhile: try again", panel.value)};
    if (painted) again = painted->mask;
    again->version = newest + 1, again->made_at = at;
    insert_mask(connection, panel, *again);
    take_back(connection, panel, version, who, at);
    return newest + 1;
  });
}

Result<std::vector<MaskEdit>> Masks::counting(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<MaskEdit>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    SQLite::Statement rows(connection, fmt::format("{}AND r.edit IS NULL ORDER BY e.id", kEditColumns));
    rows.bind(1, panel.value);
    std::vector<MaskEdit> out;
    while (rows.executeStep()) out.push_back(read_edit(rows, panel));
    return out;
  });
}

Result<MaskEditPage> Masks::list(const PanelId& panel, MaskEditId after, int limit, bool only_counting) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<MaskEditPage> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    SQLite::Statement rows(connection, fmt::format("{}AND e.id > ?2 {}ORDER BY e.id LIMIT ?3", kEditColumns,
                                                   only_counting ? "AND r.edit IS NULL " : ""));
    SQLite::bind(rows, panel.value, after.value, limit < 0 ? limit : limit + 1);
    MaskEditPage page;
    std::size_t corners = 0;
    while (rows.executeStep()) {
      page.more = limit >= 0 && (std::ssize(page.edits) == limit || corners >= kMostMaskEditCorners);
      if (page.more) break;
      page.edits.push_back(read_edit(rows, panel));
      corners += micro::corners_of(page.edits.back().shape.micro_area());
    }
    return page;
  });
}

Result<MaskEdit> Masks::find(const PanelId& panel, MaskEditId edit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<MaskEdit> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    auto found = edit_of(connection, panel, edit);
    if (!found) return no_such_edit(panel, edit);
    return std::move(*found);
  });
}

Result<MaskEditId> Masks::add(const PanelId& panel, const MaskEdit& edit, const MaskRecord& made, int after) {
  if (edit.shape.empty())
    return Error{ErrorCode::kInvalidArgument,
                 "an edit of a mask needs an outline with an area: give three corners at "
                 "least"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<MaskEditId> {
    const auto version = enter_version(connection, panel, made, after);
    if (!version.ok()) return version.error();
    SQLite::Statement insert(connection,
                             "INSERT INTO mask_edits (panel, kind, shape_um, who, note, at) VALUES (?, ?, ?, ?, ?, ?)");
    SQLite::bind(insert, panel.value, edit.give ? kGive : "withhold", write_area(edit.shape.micro_area()), edit.who,
                 edit.note, edit.at);
    insert.exec();
    const MaskEditId id{connection.getLastInsertRowid()};
    append_to_chain(connection,
                    {0, edit.at, edit.who, edit.give ? "mask.give" : "mask.withhold",
                     fmt::format("panel {}, version {}: edit {}, {:.2f} mm2 painted{}", panel.value, *version, id.value,
                                 edit.shape.area().count(), change_words(connection, panel, *version))});
    return id;
  });
}

Status Masks::add_behind(const PanelId& panel, const std::function<Status()>& enter,
                         const std::vector<PaintedEdit>& edits) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status entered = enter(); !entered.ok()) return entered;
    for (const PaintedEdit& painted : edits)
      if (const auto added = add(panel, painted.edit, painted.made, newest_mask(connection, panel)); !added.ok())
        return added.error();
    return Ok();
  });
}

Status Masks::remove(const PanelId& panel, MaskEditId edit, const std::string& who, const std::string& at,
                     const MaskRecord& made, int after) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto found = edit_of(connection, panel, edit);
    if (!found) return no_such_edit(panel, edit);
    if (found->removal)
      return Error{ErrorCode::kConflict,
                   fmt::format("edit {} was taken back before, on {}", edit.value, found->removal->at.substr(0, 10))};
    const auto version = enter_version(connection, panel, made, after);
    if (!version.ok()) return version.error();
    SQLite::Statement insert(connection, "INSERT INTO mask_edit_removals (edit, who, at) VALUES (?, ?, ?)");
    SQLite::bind(insert, edit.value, who, at);
    insert.exec();
    append_to_chain(
        connection,
        {0, at, who, "mask.take_back",
         fmt::format("panel {}, version {}: edit {} ({:.2f} mm2 {} by {}) does not count any more{}", panel.value,
                     *version, edit.value, found->shape.area().count(), found->give ? "given" : "withheld", found->who,
                     change_words(connection, panel, *version))});
    return Ok();
  });
}

}  // namespace veneer::db
