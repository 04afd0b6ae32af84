#include "db/panels.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <set>

#include "db/panel_sql.h"
#include "db/part_sql.h"
#include "db/proposal_sql.h"
#include "db/shapes.h"
#include "db/sql.h"
#include "db/surface_sql.h"

namespace veneer::db {
namespace {

constexpr const char* kPanelColumns =
    "SELECT p.id, p.name, p.width_um, p.height_um, m.map_file, m.mask_file, m.map_hash, p.created_at, p.parent, "
    "p.root, m.version, a.usable_um2, r.retired, r.reason, r.at, s.retirement FROM panels AS p JOIN masks AS m ON "
    "m.panel = p.id AND "
    "m.version = (SELECT max(version) FROM masks WHERE panel = p.id) LEFT JOIN mask_areas AS a ON a.panel = m.panel "
    "AND a.version = m.version LEFT JOIN retirements AS r ON r.id = (SELECT max(id) FROM retirements WHERE panel = "
    "p.id) LEFT JOIN splits AS s ON s.retirement = r.id ";

Face face_of(const std::string& name) { return name == "back" ? Face::kBack : Face::kShow; }
FiducialKind fiducial_kind_of(const std::string& name) {
  return name == "hole" ? FiducialKind::kHole : FiducialKind::kTag;
}

PanelRecord read_panel(SQLite::Statement& row) {
  PanelRecord panel;
  panel.id = {text(row.getColumn(0))};
  panel.name = text(row.getColumn(1));
  panel.width = from_um(row.getColumn(2).getInt64());
  panel.height = from_um(row.getColumn(3).getInt64());
  panel.map_file = text(row.getColumn(4));
  panel.mask_file = text(row.getColumn(5));
  panel.map_hash = text(row.getColumn(6));
  panel.created_at = text(row.getColumn(7));
  if (auto parent = text_or_null(row.getColumn(8))) panel.parent = PanelId{*parent};
  panel.root = {text(row.getColumn(9))};
  panel.mask_version = row.getColumn(10).getInt();
  panel.usable = area_or_null(row.getColumn(11));
  if (!row.getColumn(12).isNull() && row.getColumn(12).getInt() == 1)
    panel.retired = Retirement{text(row.getColumn(13)), text(row.getColumn(14)), !row.getColumn(15).isNull()};
  return panel;
}

constexpr const char* kScanColumns =
    "SELECT id, face, device, file, sha256, dpi, rms_mm, max_mm, lattice, taken_at FROM scans ";

ScanRecord read_scan(SQLite::Statement& row, const PanelId& panel) {
  ScanRecord scan;
  scan.id = {row.getColumn(0).getInt64()};
  scan.panel = panel;
  scan.face = face_of(text(row.getColumn(1)));
  scan.device = text(row.getColumn(2));
  scan.file = text(row.getColumn(3));
  scan.sha256 = text(row.getColumn(4));
  scan.dpi = row.getColumn(5).getDouble();
  if (!row.getColumn(6).isNull()) scan.rms = Millimetres(row.getColumn(6).getDouble());
  if (!row.getColumn(7).isNull()) scan.max = Millimetres(row.getColumn(7).getDouble());
  scan.lattice = text(row.getColumn(8));
  scan.taken_at = text(row.getColumn(9));
  return scan;
}

// The number in "P-0001"; 0 when the id is not such a name. The schema checks that number and name agree.
std::int64_t number_of(const PanelId& id) {
  std::int64_t number = 0;
  const std::string& name = id.value;
  if (name.size() < 3 || name.substr(0, 2) != "P-") return 0;
  const auto [end, error] = std::from_chars(name.data() + 2, name.data() + name.size(), number);
  return error == std::errc() && end == name.data() + name.size() ? number : 0;
}

// Suspect wood of a panel that was sawn apart: nobody knows whether its part lacks it.
std::optional<Error> doubt_about(SQLite::Database& connection, const PanelId& parent) {
  SQLite::Statement suspect(
      connection,
      "SELECT t.mark, a.job FROM allocations AS a JOIN pieces AS p ON p.id = a.piece JOIN patches "
      "AS t ON t.id = p.patch WHERE a.panel = ? AND a.state = 'suspect' ORDER BY a.id LIMIT 1");
  suspect.bind(1, parent.value);
  if (!suspect.executeStep()) return std::nullopt;
  return Error{
      ErrorCode::kConflict,
      fmt::format("piece {0} of job {1}, which was cut from panel {2}, is suspect: say first what became of it "
                  "with `veneerctl job settle {1} {0}`, then scan the part again",
                  text(suspect.getColumn(0)), suspect.getColumn(1).getInt64(), parent.value)};
}

// Freezes the faces that `fiducials` speak of; a face that is frozen already refuses.
Status freeze_fiducials(SQLite::Database& connection, const PanelId& panel,
                        const std::vector<FiducialRecord>& fiducials) {
  std::set<Face> faces;
  for (const auto& fiducial : fiducials) faces.insert(fiducial.face);
  SQLite::Statement known(connection, "SELECT 1 FROM fiducials WHERE panel = ? AND face = ? LIMIT 1");
  for (const Face face : faces) {
    known.reset();
    SQLite::bind(known, panel.value, to_string(face));
    if (known.executeStep())
      return Error{ErrorCode::kConflict, fmt::format("the fiducials of panel {} on its {} face are frozen already: fit "
                                                     "the scan to them",
                                                     panel.value, to_string(face))};
  }
  insert_fiducials(connection, panel, fiducials);
  return Ok();
}

// Each tag is on one sheet of the stock.
Status check_tags_are_new(SQLite::Database& connection, const std::vector<FiducialRecord>& fiducials) {
  SQLite::Statement same(connection,
                         fmt::format("SELECT p.id FROM fiducials AS f JOIN panels AS p ON p.id = f.panel WHERE "
                                     "f.kind = 'tag' AND f.number = ? AND {} LIMIT 1",
                                     kIsInStock));
  for (const auto& fiducial : fiducials) {
    if (fiducial.kind != FiducialKind::kTag) continue;
    same.reset();
    same.bind(1, fiducial.tag_id);
    if (same.executeStep())
      return Error{ErrorCode::kConflict, fmt::format("panel {} is in stock and carries tag {}: scan the sheet again",
                                                     text(same.getColumn(0)), fiducial.tag_id)};
  }
  return Ok();
}

Status enter_panel(SQLite::Database& connection, const PanelRecord& panel, const std::vector<ScanRecord>& scans,
                   const std::vector<FiducialRecord>& fiducials) {
  const std::int64_t number = number_of(panel.id);
  if (number <= 0)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("'{}' is no panel id: they look like P-0001", panel.id.value)};
  if (panel_exists(connection, panel.id))
    return Error{ErrorCode::kConflict, fmt::format("panel {} exists already", panel.id.value)};
  for (const auto& relative : {panel.parent.value_or(PanelId{}), panel.root})
    if (!relative.value.empty() && relative != panel.id && !panel_exists(connection, relative))
      return no_such_panel(relative);
  for (const auto& scan : scans)
    if (scan.panel != panel.id)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("a scan of panel {} came with panel {}", scan.panel.value, panel.id.value)};
  if (Status unique = check_tags_are_new(connection, fiducials); !unique) return unique;
  SQLite::Statement insert(connection,
                           "INSERT INTO panels (number, id, name, width_um, height_um, created_at, parent, root) "
                           "VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, number, panel.id.value, panel.name, to_um(panel.width), to_um(panel.height), panel.created_at);
  panel.parent ? insert.bind(7, panel.parent->value) : insert.bind(7);
  insert.bind(8, panel.root.value.empty() ? panel.id.value : panel.root.value);
  insert.exec();
  insert_mask(connection, panel.id,
              {1, panel.map_file, panel.mask_file, panel.map_hash, panel.created_at, panel.usable});
  insert_scans(connection, scans);
  return freeze_fiducials(connection, panel.id, fiducials);
}

}  // namespace

void insert_scans(SQLite::Database& connection, const std::vector<ScanRecord>& scans) {
  SQLite::Statement insert(connection,
                           "INSERT INTO scans (panel, face, device, file, sha256, dpi, rms_mm, max_mm, lattice, "
                           "taken_at) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const ScanRecord& scan : scans) {
    insert.reset();
    SQLite::bind(insert, scan.panel.value, to_string(scan.face), scan.device, scan.file, scan.sha256, scan.dpi);
    scan.rms ? insert.bind(7, scan.rms->count()) : insert.bind(7);
    scan.max ? insert.bind(8, scan.max->count()) : insert.bind(8);
    insert.bind(9, scan.lattice);
    insert.bind(10, scan.taken_at);
    insert.exec();
  }
}

void insert_fiducials(SQLite::Database& connection, const PanelId& panel,
                      const std::vector<FiducialRecord>& fiducials) {
  SQLite::Statement insert(connection,
                           "INSERT INTO fiducials (panel, face, kind, number, corners_um) VALUES (?, ?, ?, ?, ?)");
  for (const auto& fiducial : fiducials) {
    insert.reset();
    SQLite::bind(insert, panel.value, to_string(fiducial.face), to_string(fiducial.kind), fiducial.tag_id,
                 write_ring(to_micro(fiducial.corners)));
    insert.exec();
  }
}

const char* to_string(FiducialKind kind) { return kind == FiducialKind::kTag ? "tag" : "hole"; }

Result<PanelId> Panels::next_panel_id() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<PanelId> {
    SQLite::Statement row(connection,
                          "SELECT coalesce((SELECT seq FROM sqlite_sequence WHERE name = 'panels'), 0) + 1");
    row.executeStep();
    return PanelId{fmt::format("P-{:04d}", row.getColumn(0).getInt64())};
  });
}

Status Panels::add(const PanelRecord& panel, const std::vector<ScanRecord>& scans,
                   const std::vector<FiducialRecord>& fiducials, const std::optional<Acceptance>& of,
                   const std::vector<ZoneRecord>& zones) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status in = enter_panel(connection, panel, scans, fiducials); !in.ok()) return in;
    if (Status zoned = Materials(*database_).add_zones(panel.id, zones); !zoned.ok()) return zoned;
    return of ? accept(connection, *of, panel.id, 1, panel.created_at) : Ok();
  });
}

Status Panels::add_part(const PanelRecord& panel, const std::vector<ScanRecord>& scans,
                        const std::vector<FiducialRecord>& fiducials, const PartRecord& part,
                        const std::optional<Acceptance>& of, const std::vector<ZoneRecord>& zones) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement parent(connection, std::string(kPanelColumns) + "WHERE p.id = ?");
    parent.bind(1, panel.parent.value_or(PanelId{}).value);
    if (!parent.executeStep()) return no_such_panel(panel.parent.value_or(PanelId{}));
    const PanelRecord from = read_panel(parent);
    if (!from.retired || !from.retired->sawn)
      return Error{ErrorCode::kConflict,
                   fmt::format("panel {0} was put back into stock meanwhile: run `veneerctl panel split {0}` if it was "
                               "sawn apart, and scan the part again",
                               from.id.value)};
    if (const auto one = db::merged_into(connection, from.id))
      return Error{
          ErrorCode::kConflict,
          fmt::format("panel {0} is panel {1}, which holds its wood: run `veneerctl panel split {1}` if it was "
                      "sawn apart, and scan the part again",
                      from.id.value, one->value)};
    if (auto doubt = doubt_about(connection, from.id)) return *std::move(doubt);
    PanelRecord entered = panel;
    entered.root = from.root;
    if (Status in = enter_panel(connection, entered, scans, fiducials); !in.ok()) return in;
    if (const auto other = booked_under(connection, panel.id))
      return Error{ErrorCode::kConflict,
                   fmt::format("wood of this part was booked under panel {0}: run `veneerctl panel restore {0}` and "
                               "scan it again",
                               *other)};
    carry_over(connection, entered, part, panel.created_at);
    if (Status zoned = Materials(*database_).add_zones(panel.id, zones); !zoned.ok()) return zoned;
    return of ? accept(connection, *of, panel.id, 1, panel.created_at) : Ok();
  });
}

Result<std::optional<PartRecord>> Panels::part(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<PartRecord>> {
    SQLite::Statement row(
        connection, "SELECT angle_rad, shift_x_mm, shift_y_mm, improper, fiducials, rms_mm FROM parts WHERE panel = ?");
    row.bind(1, panel.value);
    if (!row.executeStep()) return std::optional<PartRecord>();
    return std::optional(PartRecord{read_isometry<PanelFrame, PanelFrame>(row, 0), row.getColumn(4).getInt(),
                                    Millimetres(row.getColumn(5).getDouble())});
  });
}

Result<std::vector<PanelId>> Panels::parts_of(const PanelId& parent) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PanelId>> {
    SQLite::Statement rows(connection,
                           "SELECT p.id FROM parts AS t JOIN panels AS p ON p.id = t.panel WHERE p.parent = ? ORDER BY "
                           "p.number");
    rows.bind(1, parent.value);
    std::vector<PanelId> out;
    while (rows.executeStep()) out.push_back({text(rows.getColumn(0))});
    return out;
  });
}

Status Panels::add_scans(const PanelId& panel, const std::vector<ScanRecord>& scans,
                         const std::vector<FiducialRecord>& fiducials, const std::vector<FiducialRecord>& new_tags) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    if (is_retired(connection, panel)) return retired_meanwhile(panel);
    for (const auto& scan : scans)
      if (scan.panel != panel)
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("a scan of panel {} came with panel {}", scan.panel.value, panel.value)};
    insert_scans(connection, scans);
    if (Status unique = check_tags_are_new(connection, new_tags); !unique) return unique;
    insert_fiducials(connection, panel, new_tags);
    return freeze_fiducials(connection, panel, fiducials);
  });
}

Status Panels::note_restoration(const std::string& made_at, const std::string& who, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement insert(connection,
                             "INSERT INTO restorations (made_at, last_scan, who, at) VALUES (?, (SELECT "
                             "coalesce(max(id), 0) FROM scans), ?, ?)");
    SQLite::bind(insert, made_at, who, at);
    insert.exec();
    return Ok();
  });
}

Status Panels::check_seen(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Status { return db::check_seen(connection, panel); });
}

Result<PanelRecord> Panels::find(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<PanelRecord> {
    SQLite::Statement row(connection, std::string(kPanelColumns) + "WHERE p.id = ?");
    row.bind(1, panel.value);
    if (!row.executeStep()) return no_such_panel(panel);
    return read_panel(row);
  });
}

Result<std::vector<PanelRecord>> Panels::list() { return list(0, -1); }

Result<std::vector<PanelRecord>> Panels::list(std::int64_t skipped, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PanelRecord>> {
    SQLite::Statement rows(connection, std::string(kPanelColumns) + "ORDER BY p.number LIMIT ? OFFSET ?");
    SQLite::bind(rows, limit, skipped);
    std::vector<PanelRecord> out;
    while (rows.executeStep()) out.push_back(read_panel(rows));
    return out;
  });
}

Result<std::vector<PanelRecord>> Panels::in_stock() {
  auto all = list();
  if (all.ok()) std::erase_if(*all, [](const PanelRecord& panel) { return panel.retired.has_value(); });
  return all;
}

Result<std::map<PanelId, PanelSummary>> Panels::summaries(const std::optional<PanelId>& of) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::map<PanelId, PanelSummary>> {
    SQLite::Statement rows(
        connection,
        fmt::format("SELECT p.id, (SELECT count(*) FROM differences AS d WHERE d.panel = p.id AND NOT EXISTS (SELECT 1 "
                    "FROM difference_verdicts WHERE difference = d.id)), EXISTS (SELECT 1 FROM fiducials WHERE panel = "
                    "p.id AND face = 'back'), (SELECT rms_mm FROM scans WHERE panel = p.id ORDER BY id DESC LIMIT 1) "
                    "FROM panels AS p{}",
                    of ? " WHERE p.id = ?" : ""));
    if (of) rows.bind(1, of->value);
    std::map<PanelId, PanelSummary> out;
    while (rows.executeStep()) {
      PanelSummary& told = out[PanelId{text(rows.getColumn(0))}];
      told.open_differences = rows.getColumn(1).getInt();
      told.back_known = rows.getColumn(2).getInt() != 0;
      if (!rows.isColumnNull(3)) told.rms = Millimetres(rows.getColumn(3).getDouble());
    }
    return out;
  });
}

Result<std::vector<FiducialRecord>> Panels::fiducials(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<FiducialRecord>> {
    SQLite::Statement rows(connection,
                           "SELECT kind, number, face, corners_um FROM fiducials WHERE panel = ? "
                           "ORDER BY face DESC, kind DESC, number");
    rows.bind(1, panel.value);
    std::vector<FiducialRecord> out;
    while (rows.executeStep()) {
      const auto corners = read_ring(text(rows.getColumn(3)));
      if (!corners) throw damaged("a fiducial of panel " + panel.value);
      out.push_back({fiducial_kind_of(text(rows.getColumn(0))), rows.getColumn(1).getInt(),
                     face_of(text(rows.getColumn(2))), from_micro<PanelFrame>(*corners)});
    }
    return out;
  });
}

Result<std::optional<int>> Panels::highest_tag() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<int>> {
    SQLite::Statement row(connection, "SELECT max(number) FROM fiducials WHERE kind = ?");
    row.bind(1, to_string(FiducialKind::kTag));
    row.executeStep();
    return row.isColumnNull(0) ? std::optional<int>() : row.getColumn(0).getInt();
  });
}

Result<std::vector<ScanRecord>> Panels::scans(const PanelId& panel) { return scans(panel, {}, -1); }

Result<std::vector<ScanRecord>> Panels::scans(const PanelId& panel, ScanId after, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<ScanRecord>> {
    SQLite::Statement rows(connection, std::string(kScanColumns) + "WHERE panel = ? AND id > ? ORDER BY id LIMIT ?");
    SQLite::bind(rows, panel.value, after.value, limit);
    std::vector<ScanRecord> out;
    while (rows.executeStep()) out.push_back(read_scan(rows, panel));
    return out;
  });
}

Result<std::optional<ScanRecord>> Panels::last_scan(const PanelId& panel, Face face) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<ScanRecord>> {
    SQLite::Statement row(connection,
                          std::string(kScanColumns) + "WHERE panel = ? AND face = ? ORDER BY id DESC LIMIT 1");
    SQLite::bind(row, panel.value, to_string(face));
    if (!row.executeStep()) return std::optional<ScanRecord>();
    return std::optional(read_scan(row, panel));
  });
}

Result<std::optional<std::string>> Panels::scanned_before(const std::string& sha256,
                                                          const std::optional<PanelId>& panel) {
  // The scans of a proposal have their content in their names (daemon/stock/panel_library.h).
  constexpr std::size_t kInName = 16;
  if (sha256.size() < kInName) return std::optional<std::string>();
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<std::string>> {
    SQLite::Statement row(
        connection,
        "SELECT coalesce((SELECT taken_at FROM scans WHERE sha256 = ?1 AND (?2 IS NULL OR panel = ?2) ORDER BY id DESC "
        "LIMIT 1), (SELECT p.made_at FROM proposals AS p JOIN proposal_verdicts AS v ON v.proposal = p.id WHERE "
        "p.panel = ?2 AND EXISTS (SELECT 1 FROM json_each(p.scan_files) AS e WHERE e.value LIKE '%' || ?3 || '.%') "
        "ORDER BY p.id DESC LIMIT 1))");
    row.bind(1, sha256);
    panel ? row.bind(2, panel->value) : row.bind(2);
    row.bind(3, sha256.substr(0, kInName));
    row.executeStep();
    return row.isColumnNull(0) ? std::optional<std::string>() : text(row.getColumn(0));
  });
}

}  // namespace veneer::db
