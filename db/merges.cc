#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "db/lease_sql.h"
#include "db/panel_sql.h"
#include "db/part_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

// Wood of the panel that is kept, as it says so.
struct Held {
  std::string state, whose;
  Region<PanelFrame> area;
};

std::vector<Held> held_by(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement rows(connection,
                         "SELECT a.state, a.area_um, a.job, t.mark, e.plan, a.reason FROM allocations AS a LEFT JOIN "
                         "pieces AS p ON p.id = a.piece LEFT JOIN patches AS t ON t.id = p.patch LEFT JOIN leases AS e "
                         "ON e.id = a.lease WHERE a.panel = ? AND a.state <> 'released' ORDER BY a.id");
  rows.bind(1, panel.value);
  std::vector<Held> out;
  while (rows.executeStep()) {
    auto area = read_area(text(rows.getColumn(1)));
    if (!area) throw damaged("an allocation of panel " + panel.value);
    std::string whose = text(rows.getColumn(5));
    if (const auto mark = text_or_null(rows.getColumn(3)))
      whose = fmt::format("piece {} of job {}", *mark, rows.getColumn(2).getInt64());
    else if (!rows.getColumn(4).isNull())
      whose = fmt::format("plan {}", rows.getColumn(4).getInt64());
    out.push_back({text(rows.getColumn(0)), std::move(whose), Region<PanelFrame>(std::move(*area))});
  }
  return out;
}

Error contradiction(const MergeRecord& merge, const Gone& gone, const Held& held) {
  if (held.state == "cut")
    return {
        ErrorCode::kConflict,
        fmt::format("{} was cut from panel {}, and by the record of panel {} {} was in the same place: one place is "
                    "cut once, so these are two sheets; or settle first which of the two was never cut",
                    held.whose, merge.kept.value, merge.merged.value, gone.reason)};
  if (held.state == "leased")
    return {
        ErrorCode::kConflict,
        fmt::format("{} leases wood of panel {} that is gone by the record of panel {}: run `veneerctl job release` "
                    "first",
                    held.whose, merge.kept.value, merge.merged.value)};
  return {ErrorCode::kConflict,
          fmt::format("{} is {} on wood of panel {} that is gone by the record of panel {}: cancel its job, or settle "
                      "the piece, first",
                      held.whose, held.state, merge.kept.value, merge.merged.value)};
}

// What is left to be booked of each of `gone`: wood that is written off on both is booked once.
Result<std::vector<Region<PanelFrame>>> not_booked_yet(const MergeRecord& merge, const std::vector<Gone>& gone,
                                                       std::vector<Region<PanelFrame>> areas,
                                                       const std::vector<Held>& held) {
  constexpr Millimetres kRounding{0.003};
  for (std::size_t i = 0; i < gone.size(); ++i)
    for (const Held& other : held) {
      if (areas[i].empty() || !overlaps(areas[i], other.area)) continue;
      if (other.state != "scrap" && gone[i].state != "scrap") return contradiction(merge, gone[i], other);
      if (other.state != "scrap" && other.state != "cut") return contradiction(merge, gone[i], other);
      areas[i] = subtract(areas[i], offset(other.area, kRounding, Corners::kRound));
    }
  return areas;
}

std::int64_t newest_scan(SQLite::Database& connection) {
  return connection.execAndGet("SELECT coalesce(max(id), 0) FROM scans").getInt64();
}

void enter(SQLite::Database& connection, const MergeRecord& merge, std::int64_t last_scan) {
  SQLite::Statement insert(connection,
                           "INSERT INTO merges (kept, merged, angle_rad, shift_x_mm, shift_y_mm, improper, fiducials, "
                           "rms_mm, last_scan, who, at) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(1, merge.kept.value);
  insert.bind(2, merge.merged.value);
  bind_isometry(insert, 3, merge.kept_from_merged);
  insert.bind(7, merge.fiducials);
  insert.bind(8, merge.rms.count());
  insert.bind(9, last_scan);
  insert.bind(10, merge.who);
  insert.bind(11, merge.at);
  insert.exec();
}

Status check_may_merge(SQLite::Database& connection, const MergeRecord& merge) {
  for (const PanelId& panel : {merge.kept, merge.merged})
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
  if (merge.kept == merge.merged)
    return Error{ErrorCode::kInvalidArgument, "a panel cannot be merged with itself: name two"};
  if (is_retired(connection, merge.kept)) return retired_meanwhile(merge.kept);
  if (const auto one = merged_into(connection, merge.merged))
    return Error{ErrorCode::kConflict,
                 fmt::format("panel {} was merged into panel {} before", merge.merged.value, one->value)};
  SQLite::Statement parts(connection,
                          "SELECT p.id FROM parts AS t JOIN panels AS p ON p.id = t.panel WHERE p.parent = ?");
  parts.bind(1, merge.merged.value);
  if (parts.executeStep())
    return Error{ErrorCode::kConflict, fmt::format("panel {} was sawn apart, and panel {} is a part of it: merge the "
                                                   "parts, each with its own record",
                                                   merge.merged.value, text(parts.getColumn(0)))};
  SQLite::Statement run(connection, "SELECT panel FROM runs WHERE ended_at IS NULL AND panel IN (?, ?)");
  SQLite::bind(run, merge.kept.value, merge.merged.value);
  if (run.executeStep())
    return Error{ErrorCode::kConflict,
                 fmt::format("panel {} is being cut: wait until the run is over", text(run.getColumn(0)))};
  return Ok();
}

}  // namespace

std::optional<PanelId> merged_into(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement row(connection, "SELECT kept FROM merges WHERE merged = ?");
  row.bind(1, panel.value);
  if (!row.executeStep()) return std::nullopt;
  return PanelId{text(row.getColumn(0))};
}

Status Panels::merge(const MergeRecord& merge, const std::vector<FiducialRecord>& tags,
                     const std::vector<ScanRecord>& scans) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status may = check_may_merge(connection, merge); !may.ok()) return may;
    end_expired(connection, merge.at);
    if (!is_retired(connection, merge.merged))
      if (Status left =
              leave_stock(connection, merge.merged, fmt::format("it is panel {}: merged", merge.kept.value), merge.at);
          !left.ok())
        return left;
    SQLite::Statement size(connection, "SELECT width_um, height_um FROM panels WHERE id = ?");
    size.bind(1, merge.kept.value);
    size.executeStep();
    const Millimetres none(0), width = from_um(size.getColumn(0).getInt64()),
                               height = from_um(size.getColumn(1).getInt64());
    const Region<PanelFrame> sheet(Ring<PanelFrame>{{none, none}, {width, none}, {width, height}, {none, height}});
    const auto gone = gone_from(connection, merge.merged);
    std::vector<Region<PanelFrame>> areas;
    areas.reserve(gone.size());
    for (const Gone& wood : gone) areas.push_back(wood.area);
    const auto left =
        not_booked_yet(merge, gone, moved_apart(areas, merge.kept_from_merged, sheet), held_by(connection, merge.kept));
    if (!left.ok()) return left.error();
    // The other face tells nothing of wood; the same one does, as it was then.
    const bool other_face = merge.kept_from_merged.handedness() == Handedness::kImproper;
    const bool carries = std::any_of(left->begin(), left->end(), [](const auto& area) { return !area.empty(); });
    enter(connection, merge, other_face && !carries ? 0 : newest_scan(connection));
    for (std::size_t i = 0; i < gone.size(); ++i)
      if (!(*left)[i].empty())
        book_carried(connection, merge.kept, gone[i], (*left)[i], merge.kept_from_merged, merge.at);
    insert_fiducials(connection, merge.kept, tags);
    insert_scans(connection, scans);
    return Ok();
  });
}

Result<std::optional<PanelId>> Panels::merged_into(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<PanelId>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    return db::merged_into(connection, panel);
  });
}

}  // namespace veneer::db
