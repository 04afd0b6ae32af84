#include "db/plans.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "base/hash.h"
#include "db/job_sql.h"
#include "db/lease_sql.h"
#include "db/plan_files.h"
#include "db/plan_sql.h"
#include "db/shapes.h"
#include "db/sql.h"
#include "db/surface_sql.h"

namespace veneer::db {
namespace {

constexpr const char* kPlanColumns =
    "SELECT id, name, parent, who, created_at, target_file, preview_file, options_json, report_json, (SELECT count(*) "
    "FROM patches WHERE plan = coalesce((SELECT j.plan FROM redos AS d JOIN jobs AS j ON j.id = d.job WHERE d.plan = "
    "plans.id), plans.id)), (SELECT count(*) FROM placements WHERE plan = plans.id) FROM plans ";

// The wood that the piece itself needs must be among what it books, or its neighbours would be cut into.
bool area_holds_outline(const PlannedPatch& patch) {
  if (patch.allocation.empty() || patch.panel_outline.size() < 3) return false;
  return subtract(Region<PanelFrame>(patch.panel_outline), patch.allocation).area() < SquareMillimetres(1e-3);
}

Status check(const NewPlan& plan) {
  const auto wrong = [](std::string what) { return Error{ErrorCode::kInvalidArgument, std::move(what)}; };
  for (const PlannedPatch& patch : plan.pieces) {
    if (!patch.panel) continue;
    if (patch.panel_outline.size() != patch.artwork_outline.size())
      return wrong(fmt::format("the two outlines of piece {} have different vertices", patch.mark));
    if (!area_holds_outline(patch))
      return wrong(fmt::format("the wood booked for piece {} does not hold its outline", patch.mark));
    if (std::none_of(plan.planned_on.begin(), plan.planned_on.end(),
                     [&](const auto& p) { return p.panel == *patch.panel; }))
      return wrong(
          fmt::format("piece {} is taken from panel {}, which the plan does not name", patch.mark, patch.panel->value));
  }
  return Ok();
}

class PlacementRows {
 public:
  PlacementRows(SQLite::Database& connection, PlanId plan)
      : plan_(plan),
        row_(connection,
             "INSERT INTO placements (plan, patch, panel, panel_outline_um, area_um, angle_rad, shift_x_mm, "
             "shift_y_mm, improper, lead_in_um) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)") {}

  void insert(std::int64_t patch_row, const PlannedPatch& patch) {
    std::vector<Point<PanelFrame>> lead_in;
    if (patch.lead_in) lead_in.push_back(*patch.lead_in);
    row_.reset();
    SQLite::bind(row_, plan_.value, patch_row, patch.panel->value, write_outline(to_micro(patch.panel_outline)),
                 write_area(patch.allocation.micro_area()));
    bind_isometry(row_, 6, patch.panel_from_artwork);
    row_.bind(10, write_ring(to_micro(lead_in)));
    row_.exec();
  }

 private:
  PlanId plan_;
  SQLite::Statement row_;
};

void insert_patches(SQLite::Database& connection, PlanId plan, const std::vector<PlannedPatch>& patches) {
  SQLite::Statement patch_row(connection,
                              "INSERT INTO patches (plan, ordinal, mark, artwork_outline_um) VALUES (?, ?, ?, ?)");
  PlacementRows placements(connection, plan);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const PlannedPatch& patch = patches[i];
    patch_row.reset();
    SQLite::bind(patch_row, plan.value, static_cast<std::int64_t>(i), patch.mark,
                 write_outline(to_micro(patch.artwork_outline)));
    patch_row.exec();
    if (patch.panel) placements.insert(connection.getLastInsertRowid(), patch);
  }
}

// The plan's own row and its panels, without patches.
Result<PlanId> insert_row(SQLite::Database& connection, const NewPlan& plan, const std::string& at) {
  const auto file = keep_plan_file(connection.getFilename(), plan.plan_json);
  if (!file) return file.error();
  SQLite::Statement insert(connection,
                           "INSERT INTO plans (name, who, created_at, target_file, preview_file, plan_sha256, "
                           "plan_bytes, options_json, report_json, parent) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, plan.name, plan.who, at, plan.target_file, plan.preview_file, file->sha256, file->bytes,
               plan.options_json, plan.report_json);
  if (plan.parent) insert.bind(10, plan.parent->value);
  insert.exec();
  const PlanId id{connection.getLastInsertRowid()};
  SQLite::Statement panel(connection, "INSERT INTO plan_panels (plan, panel, mask_version) VALUES (?, ?, ?)");
  for (const PlannedPanel& planned : plan.planned_on) {
    panel.reset();
    SQLite::bind(panel, id.value, planned.panel.value, planned.mask_version);
    panel.exec();
  }
  return id;
}

// Both name the same vertices, but for what was rounded on the way through a file.
bool same_outline(const Ring<ArtworkFrame>& a, const Ring<ArtworkFrame>& b) {
  constexpr Millimetres kRounding(0.002);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](const auto& p, const auto& q) { return distance(p, q) <= kRounding; });
}

PlanRecord read_plan(SQLite::Database& connection, SQLite::Statement& row) {
  PlanRecord plan;
  plan.id = {row.getColumn(0).getInt64()};
  plan.name = text(row.getColumn(1));
  if (!row.getColumn(2).isNull()) plan.parent = PlanId{row.getColumn(2).getInt64()};
  plan.who = text(row.getColumn(3));
  plan.created_at = text(row.getColumn(4));
  plan.target_file = text(row.getColumn(5));
  plan.preview_file = text(row.getColumn(6));
  plan.options_json = text(row.getColumn(7));
  plan.report_json = text(row.getColumn(8));
  plan.patches = row.getColumn(9).getInt();
  plan.placed = row.getColumn(10).getInt();
  SQLite::Statement panels(connection,
                           "SELECT panel, mask_version, (SELECT max(version) FROM masks WHERE panel = p.panel) "
                           "FROM plan_panels AS p WHERE plan = ? ORDER BY panel");
  panels.bind(1, plan.id.value);
  while (panels.executeStep()) {
    plan.panels.push_back({{text(panels.getColumn(0))}, panels.getColumn(1).getInt()});
    if (panels.getColumn(2).getInt() != plan.panels.back().mask_version)
      plan.outdated.push_back(plan.panels.back().panel);
  }
  SQLite::Statement jobs(connection,
                         "SELECT id FROM jobs WHERE plan = ?1 UNION SELECT job FROM redos WHERE plan = ?1 ORDER BY 1");
  jobs.bind(1, plan.id.value);
  while (jobs.executeStep()) plan.jobs.push_back({jobs.getColumn(0).getInt64()});
  plan.lease = lease_of(connection, plan.id);
  return plan;
}

PlannedPatch read_patch(SQLite::Statement& row) {
  PlannedPatch patch;
  patch.mark = text(row.getColumn(0));
  const auto artwork = read_ring(text(row.getColumn(1)));
  if (!artwork) throw damaged("patch " + patch.mark);
  patch.artwork_outline = from_micro<ArtworkFrame>(*artwork);
  if (row.getColumn(2).isNull()) return patch;
  patch.panel = PanelId{text(row.getColumn(2))};
  const auto outline = read_ring(text(row.getColumn(3)));
  const auto area = read_area(text(row.getColumn(4)));
  const auto lead_in = read_ring(text(row.getColumn(5)));
  if (!outline || !area || !lead_in) throw damaged("the place of patch " + patch.mark);
  patch.panel_outline = from_micro<PanelFrame>(*outline);
  patch.allocation = Region<PanelFrame>(*area);
  if (!lead_in->empty()) patch.lead_in = from_micro<PanelFrame>(*lead_in).front();
  patch.panel_from_artwork = read_isometry<PanelFrame, ArtworkFrame>(row, 6);
  return patch;
}

// What no row names any more. A file that cannot be removed does no harm.
void remove_unnamed(Database& database, const std::string& sha256) {
  static_cast<void>(guarded(database, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement named(connection, "SELECT 1 FROM plans WHERE plan_sha256 = ? LIMIT 1");
    named.bind(1, sha256);
    return named.executeStep() ? Ok() : remove_plan_file(database.file(), sha256);
  }));
}

// Its file goes with it, while whoever reads one moment of the database still finds its row there.
bool was_removed(const std::filesystem::path& file, PlanId plan) {
  auto now = Database::open_for_reading(file);
  return now && !plan_exists(now->connection(), plan);
}

}  // namespace

Error no_such_plan(PlanId plan) {
  return {ErrorCode::kNotFound, fmt::format("there is no plan {}: see `veneerctl job plans`", plan.value)};
}

bool plan_exists(SQLite::Database& connection, PlanId plan) {
  SQLite::Statement row(connection, "SELECT 1 FROM plans WHERE id = ?");
  row.bind(1, plan.value);
  return row.executeStep();
}

void forget_refused(Database& database, const NewPlan& plan, const Error& refused) {
  // Of a disk that failed nobody knows what it holds: the plan may be there after the next start.
  if (refused.code == ErrorCode::kStorage || refused.code == ErrorCode::kUnavailable) return;
  remove_unnamed(database, sha256_hex(std::as_bytes(std::span(plan.plan_json))));
}

Result<PlanId> insert_plan(SQLite::Database& connection, const NewPlan& plan, const std::string& at) {
  if (Status sensible = check(plan); !sensible.ok()) return sensible.error();
  auto id = insert_row(connection, plan, at);
  if (!id.ok()) return id;
  insert_patches(connection, *id, plan.pieces);
  return id;
}

Result<PlanId> insert_redo(SQLite::Database& connection, JobId job, const NewPlan& plan, const std::string& at) {
  if (Status sensible = check(plan); !sensible.ok()) return sensible.error();
  auto id = insert_row(connection, plan, at);
  if (!id.ok()) return id;
  SQLite::Statement patch_row(connection,
                              "SELECT t.id, t.artwork_outline_um FROM pieces AS p JOIN patches AS t ON t.id = p.patch "
                              "WHERE p.job = ? AND t.mark = ?");
  PlacementRows placements(connection, *id);
  for (const PlannedPatch& patch : plan.pieces) {
    patch_row.reset();
    SQLite::bind(patch_row, job.value, patch.mark);
    if (!patch_row.executeStep()) return no_such_piece(job, patch.mark);
    const auto outline = read_ring(text(patch_row.getColumn(1)));
    if (!outline) throw damaged("patch " + patch.mark);
    if (!patch.panel || !same_outline(from_micro<ArtworkFrame>(*outline), patch.artwork_outline))
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("piece {} of job {} came back without wood, or as another piece: plan it again",
                               patch.mark, job.value)};
    placements.insert(patch_row.getColumn(0).getInt64(), patch);
  }
  return id;
}

Status check_masks(SQLite::Database& connection, PlanId plan) {
  SQLite::Statement outdated(connection,
                             "SELECT panel FROM plan_panels AS p WHERE plan = ? AND mask_version <> "
                             "(SELECT max(version) FROM masks WHERE panel = p.panel) ORDER BY panel LIMIT 1");
  outdated.bind(1, plan.value);
  if (!outdated.executeStep()) {
    SQLite::Statement panels(connection, "SELECT panel FROM plan_panels WHERE plan = ? ORDER BY panel");
    panels.bind(1, plan.value);
    while (panels.executeStep())
      if (Status same = check_surface(connection, {text(panels.getColumn(0))}); !same.ok()) return same;
    return Ok();
  }
  return Error{ErrorCode::kConflict,
               fmt::format("panel {} was scanned again after this was planned, or a scan was taken back: plan again",
                           text(outdated.getColumn(0)))};
}

Status may_have_wood(SQLite::Database& connection, PlanId plan) {
  if (Status same = check_masks(connection, plan); !same.ok()) return same;
  SQLite::Statement redone(connection, "SELECT job FROM redos WHERE plan = ?");
  redone.bind(1, plan.value);
  if (!redone.executeStep()) return Ok();
  return Error{ErrorCode::kConflict, fmt::format("plan {} makes pieces of job {} again and no job of its own: plan "
                                                 "the whole picture",
                                                 plan.value, redone.getColumn(0).getInt64())};
}

Result<PlanId> Plans::add(const NewPlan& plan, const std::string& at) {
  auto added =
      in_transaction(*database_, [&](SQLite::Database& connection) { return insert_plan(connection, plan, at); });
  if (!added) forget_refused(*database_, plan, added.error());
  return added;
}

Status Plans::remove(PlanId plan) {
  std::string sha256;
  Status removed = in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement held(
        connection,
        "SELECT coalesce((SELECT min(id) FROM jobs WHERE plan = p.id), (SELECT job FROM redos WHERE "
        "plan = p.id)), (SELECT min(id) FROM plans WHERE parent = p.id), plan_sha256 FROM plans AS p WHERE id = "
        "?");
    held.bind(1, plan.value);
    if (!held.executeStep()) return no_such_plan(plan);
    if (!held.getColumn(0).isNull())
      return Error{ErrorCode::kConflict, fmt::format("plan {} stays, because job {} was made of it", plan.value,
                                                     held.getColumn(0).getInt64())};
    if (!held.getColumn(1).isNull())
      return Error{ErrorCode::kConflict, fmt::format("plan {} came from plan {}: remove that first",
                                                     held.getColumn(1).getInt64(), plan.value)};
    if (const auto lease = lease_of(connection, plan))
      return Error{ErrorCode::kConflict, fmt::format("plan {0} leases its wood until {1}: release it first with "
                                                     "`veneerctl job release {0}`",
                                                     plan.value, lease->until)};
    sha256 = text(held.getColumn(2));
    for (const char* rows :
         {"placements WHERE plan", "patches WHERE plan", "plan_panels WHERE plan", "plans WHERE id"}) {
      SQLite::Statement remove(connection, fmt::format("DELETE FROM {} = ?", rows));
      remove.bind(1, plan.value);
      remove.exec();
    }
    return Ok();
  });
  if (removed) remove_unnamed(*database_, sha256);
  return removed;
}

Result<PlanRecord> Plans::find(PlanId plan) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<PlanRecord> {
    SQLite::Statement row(connection, std::string(kPlanColumns) + "WHERE id = ?");
    row.bind(1, plan.value);
    if (!row.executeStep()) return no_such_plan(plan);
    return read_plan(connection, row);
  });
}

Result<std::vector<PlanRecord>> Plans::list() { return list({}, -1); }

Result<std::vector<PlanRecord>> Plans::list(PlanId before, int limit, bool leasing) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PlanRecord>> {
    SQLite::Statement rows(connection,
                           fmt::format("{}WHERE (?1 = 0 OR id < ?1){} ORDER BY id DESC LIMIT ?2", kPlanColumns,
                                       leasing ? " AND id IN (SELECT plan FROM leases WHERE ended IS NULL)" : ""));
    SQLite::bind(rows, before.value, limit);
    std::vector<PlanRecord> out;
    while (rows.executeStep()) out.push_back(read_plan(connection, rows));
    return out;
  });
}

Result<std::string> Plans::plan_json(PlanId plan) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::string> {
    SQLite::Statement row(connection, "SELECT plan_sha256, plan_bytes FROM plans WHERE id = ?");
    row.bind(1, plan.value);
    if (!row.executeStep()) return no_such_plan(plan);
    auto file = read_plan_file(database_->file(), {text(row.getColumn(0)), row.getColumn(1).getInt64()});
    if (!file && was_removed(database_->file(), plan)) return no_such_plan(plan);
    return file;
  });
}

Status Plans::check_files(const std::stop_token& stop) {
  const auto named = list();
  if (!named) return named.error();
  for (const PlanRecord& plan : *named) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the check was stopped before its end"};
    const auto whole = plan_json(plan.id);
    if (!whole && whole.error().code != ErrorCode::kNotFound) return whole.error();
  }
  return Ok();
}

Result<std::vector<PlannedPatch>> Plans::patches(PlanId plan) { return patches(plan, 0, -1); }

Result<std::vector<PlannedPatch>> Plans::patches(PlanId plan, std::int64_t skipped, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PlannedPatch>> {
    SQLite::Statement rows(connection,
                           "SELECT t.mark, t.artwork_outline_um, l.panel, l.panel_outline_um, l.area_um, l.lead_in_um, "
                           "l.angle_rad, l.shift_x_mm, l.shift_y_mm, l.improper FROM patches AS t LEFT JOIN placements "
                           "AS l ON l.patch = t.id AND l.plan = ?1 WHERE t.plan = ?1 OR t.id IN (SELECT patch FROM "
                           "placements WHERE plan = ?1) ORDER BY t.ordinal LIMIT ?3 OFFSET ?2");
    SQLite::bind(rows, plan.value, skipped, limit);
    std::vector<PlannedPatch> out;
    while (rows.executeStep()) out.push_back(read_patch(rows));
    return out;
  });
}

Result<std::vector<std::string>> Plans::taken(PlanId plan) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<std::string>> {
    SQLite::Statement rows(connection,
                           "SELECT t.mark FROM placements AS l JOIN patches AS t ON t.id = l.patch JOIN panels AS p ON "
                           "p.id = l.panel WHERE l.plan = ? AND EXISTS (SELECT 1 FROM allocation_boxes AS b JOIN "
                           "allocations AS a ON a.id = b.id WHERE b.min_panel = p.number AND b.min_x < "
                           "veneer_box(l.area_um, 1) AND b.max_x > veneer_box(l.area_um, 0) AND b.min_y < "
                           "veneer_box(l.area_um, 3) AND b.max_y > veneer_box(l.area_um, 2) AND "
                           "veneer_areas_overlap(a.area_um, l.area_um) AND coalesce((SELECT e.plan FROM leases AS e "
                           "WHERE e.id = a.lease), 0) <> l.plan) ORDER BY t.ordinal");
    rows.bind(1, plan.value);
    std::vector<std::string> out;
    while (rows.executeStep()) out.push_back(text(rows.getColumn(0)));
    return out;
  });
}

}  // namespace veneer::db
