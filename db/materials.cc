#include "db/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "db/panel_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

Status check(const RecipeRecord& recipe) {
  const auto wrong = [&](std::string_view what) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the recipe to {} {} {}", to_string(recipe.operation), recipe.material, what)};
  };
  if (!names_a_material(recipe.material))
    return Error{ErrorCode::kInvalidArgument, "a recipe needs the name of a material, at most 60 characters long"};
  if (!(recipe.speed.count() > 0 && recipe.speed.count() <= 1000))
    return wrong("has an impossible speed: use more than 0 and at most 1000 mm/s");
  if (!(recipe.power.count() > 0 && recipe.power.count() <= 1))
    return wrong("has an impossible power: use more than 0 and at most 1");
  if (recipe.passes < 1 || recipe.passes > 20) return wrong("has an impossible number of passes: use 1 to 20");
  if (!recipe.kerf) return Ok();
  if (recipe.operation != Operation::kCut) return wrong("has a kerf, but only cuts have one: leave it out");
  for (const Millimetres kerf : {recipe.kerf->back, recipe.kerf->show})
    if (!(kerf.count() >= 0 && kerf.count() < 5)) return wrong("has an impossible kerf: use 0 to 5 mm");
  return Ok();
}

// Zones were rings around their strips before schema 37.
std::optional<Region<PanelFrame>> read_shape(const std::string& text) {
  if (auto area = read_area(text)) return Region<PanelFrame>(*std::move(area));
  if (const auto ring = read_ring(text)) return Region<PanelFrame>(from_micro<PanelFrame>(*ring));
  return std::nullopt;
}

std::vector<ZoneRecord> read_zones(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement rows(connection,
                         "SELECT z.number, coalesce(v.outline_um, z.outline_um), z.material, c.confidence, "
                         "coalesce(v.version, 1) FROM zones AS z LEFT JOIN zone_confidences AS c ON c.panel = z.panel "
                         "AND c.number = z.number LEFT JOIN zone_versions AS v ON v.panel = z.panel AND v.number = "
                         "z.number AND v.version = (SELECT max(version) FROM zone_versions WHERE panel = z.panel AND "
                         "number = z.number) WHERE z.panel = ? ORDER BY z.number");
  rows.bind(1, panel.value);
  std::vector<ZoneRecord> out;
  while (rows.executeStep()) {
    auto shape = read_shape(text(rows.getColumn(1)));
    if (!shape) throw damaged(fmt::format("the outline of zone {} of {}", rows.getColumn(0).getInt(), panel.value));
    ZoneRecord& zone =
        out.emplace_back(ZoneRecord{rows.getColumn(0).getInt(), *std::move(shape), text(rows.getColumn(2))});
    zone.version = rows.getColumn(4).getInt();
    if (zone.version == 1 && !rows.getColumn(3).isNull()) zone.confidence = rows.getColumn(3).getDouble();
  }
  return out;
}

Region<PanelFrame> booked_wood(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement rows(connection, "SELECT id, area_um FROM allocations WHERE panel = ? AND state <> 'released'");
  rows.bind(1, panel.value);
  std::vector<Region<PanelFrame>> out;
  while (rows.executeStep()) {
    auto area = read_area(text(rows.getColumn(1)));
    if (!area) throw damaged(fmt::format("the area of allocation {}", rows.getColumn(0).getInt64()));
    out.emplace_back(*std::move(area));
  }
  return unite(out);
}

Error no_such_zone(const PanelId& panel, int zone) {
  return {ErrorCode::kNotFound,
          fmt::format("panel {} has no zone {}: see `veneerctl panel show {}`", panel.value, zone, panel.value)};
}

}  // namespace

const char* to_string(Operation operation) { return operation == Operation::kCut ? "cut" : "engrave"; }

std::optional<Operation> operation_of(const std::string& name) {
  for (const auto operation : {Operation::kCut, Operation::kEngrave})
    if (name == to_string(operation)) return operation;
  return std::nullopt;
}

Status Materials::set_recipe(const RecipeRecord& recipe) {
  if (Status good = check(recipe); !good) return good;
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    // Edited, or entered: a row never takes the place of another.
    for (const char* statement :
         {"UPDATE recipes SET speed_mm_s = ?3, power = ?4, passes = ?5, air = ?6, changed_at = ?7, kerf_back_um = ?8, "
          "kerf_show_um = ?9 WHERE material = ?1 AND operation = ?2",
          "INSERT INTO recipes (material, operation, speed_mm_s, power, passes, air, changed_at, kerf_back_um, "
          "kerf_show_um) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)"}) {
      SQLite::Statement write(connection, statement);
      SQLite::bind(write, recipe.material, to_string(recipe.operation), recipe.speed.count(), recipe.power.count(),
                   recipe.passes, recipe.air ? 1 : 0, recipe.changed_at);
      if (recipe.kerf) {
        write.bind(8, to_um(recipe.kerf->back));
        write.bind(9, to_um(recipe.kerf->show));
      }
      if (write.exec() == 1) break;
    }
    return Ok();
  });
}

Status Materials::remove_recipe(const std::string& material, Operation operation) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement remove(connection, "DELETE FROM recipes WHERE material = ? AND operation = ?");
    SQLite::bind(remove, material, to_string(operation));
    if (remove.exec() == 1) return Ok();
    return Error{ErrorCode::kNotFound, fmt::format("there is no recipe to {} {}: see `veneerctl recipe list`",
                                                   to_string(operation), material)};
  });
}

Result<std::vector<RecipeRecord>> Materials::recipes() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<RecipeRecord>> {
    SQLite::Statement rows(connection,
                           "SELECT material, operation, speed_mm_s, power, passes, air, kerf_back_um, kerf_show_um, "
                           "changed_at FROM recipes ORDER BY material, operation");
    std::vector<RecipeRecord> out;
    while (rows.executeStep()) {
      RecipeRecord& recipe = out.emplace_back();
      recipe.material = text(rows.getColumn(0));
      recipe.operation = operation_of(text(rows.getColumn(1))).value_or(Operation::kCut);  // the schema knows no third
      recipe.speed = MmPerSecond(rows.getColumn(2).getDouble());
      recipe.power = PowerFraction(rows.getColumn(3).getDouble());
      recipe.passes = rows.getColumn(4).getInt();
      recipe.air = rows.getColumn(5).getInt() != 0;
      if (!rows.getColumn(6).isNull())
        recipe.kerf = KerfRecord{from_um(rows.getColumn(6).getInt64()), from_um(rows.getColumn(7).getInt64())};
      recipe.changed_at = text(rows.getColumn(8));
    }
    return out;
  });
}

Status Materials::add_zones(const PanelId& panel, const std::vector<ZoneRecord>& zones) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    SQLite::Statement known(connection, "SELECT 1 FROM zones WHERE panel = ? LIMIT 1");
    known.bind(1, panel.value);
    if (known.executeStep()) return Ok();
    SQLite::Statement insert(connection, "INSERT INTO zones (panel, number, outline_um, material) VALUES (?, ?, ?, ?)");
    SQLite::Statement sure(connection, "INSERT INTO zone_confidences (panel, number, confidence) VALUES (?, ?, ?)");
    for (const ZoneRecord& zone : zones) {
      insert.reset();
      SQLite::bind(insert, panel.value, zone.number, write_area(zone.shape.micro_area()), zone.material);
      insert.exec();
      if (!zone.confidence) continue;
      sure.reset();
      SQLite::bind(sure, panel.value, zone.number, *zone.confidence);
      sure.exec();
    }
    return Ok();
  });
}

Result<std::vector<ZoneRecord>> Materials::zones(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<ZoneRecord>> {
    return read_zones(connection, panel);
  });
}

Result<int> Materials::draw_zone(const PanelId& panel, std::optional<int> zone, const Region<PanelFrame>& drawn,
                                 const std::string& who, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<int> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    const auto zones = read_zones(connection, panel);
    int version = 1, number = 0;
    bool known = false;
    for (const ZoneRecord& one : zones) {
      version = std::max(version, one.version), number = std::max(number, one.number);
      known = known || one.number == zone;
    }
    if (zone && !known) return no_such_zone(panel, *zone);
    const auto booked = booked_wood(connection, panel), free = subtract(drawn, booked);
    if (free.empty())
      return Error{ErrorCode::kConflict,
                   fmt::format("all that was drawn on panel {} is reserved or cut, and stays in its zone: draw it "
                               "larger, or cancel the job",
                               panel.value)};
    ++version, ++number;
    SQLite::Statement insert(
        connection,
        "INSERT INTO zone_versions (panel, number, version, outline_um, who, at) VALUES (?, ?, ?, ?, ?, ?)");
    for (const ZoneRecord& one : zones) {
      const auto shape = one.number == zone ? unite(free, intersect(one.shape, booked)) : subtract(one.shape, free);
      if (one.number != zone && !overlaps(one.shape, free)) continue;
      insert.reset();
      SQLite::bind(insert, panel.value, one.number, version, write_area(shape.micro_area()), who, at);
      insert.exec();
    }
    if (zone) return *zone;
    SQLite::Statement add(connection, "INSERT INTO zones (panel, number, outline_um, material) VALUES (?, ?, ?, '')");
    SQLite::bind(add, panel.value, number, write_area(free.micro_area()));
    add.exec();
    insert.reset();
    SQLite::bind(insert, panel.value, number, version, write_area(free.micro_area()), who, at);
    insert.exec();
    return number;
  });
}

Result<std::map<PanelId, std::vector<ZoneRecord>>> Materials::zones_without_outlines() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::map<PanelId, std::vector<ZoneRecord>>> {
    SQLite::Statement rows(
        connection,
        "SELECT z.panel, z.number, z.material, coalesce(max(v.version), 1) FROM zones AS z LEFT JOIN "
        "zone_versions AS v ON v.panel = z.panel AND v.number = z.number WHERE coalesce((SELECT outline_um FROM "
        "zone_versions AS w WHERE w.panel = z.panel AND w.number = z.number ORDER BY version DESC LIMIT 1), '') <> '~' "
        "GROUP BY z.panel, z.number ORDER BY z.panel, z.number");
    std::map<PanelId, std::vector<ZoneRecord>> out;
    while (rows.executeStep())
      out[PanelId{text(rows.getColumn(0))}].push_back(
          {rows.getColumn(1).getInt(), {}, text(rows.getColumn(2)), std::nullopt, rows.getColumn(3).getInt()});
    return out;
  });
}

Result<std::map<PanelId, std::vector<std::string>>> Materials::woods() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::map<PanelId, std::vector<std::string>>> {
    SQLite::Statement rows(
        connection,
        "SELECT panel, material FROM zones AS z WHERE material <> '' AND coalesce((SELECT outline_um "
        "FROM zone_versions AS v WHERE v.panel = z.panel AND v.number = z.number ORDER BY version "
        "DESC LIMIT 1), '') <> '~' GROUP BY panel, material ORDER BY panel, min(number)");
    std::map<PanelId, std::vector<std::string>> out;
    while (rows.executeStep()) out[PanelId{text(rows.getColumn(0))}].push_back(text(rows.getColumn(1)));
    return out;
  });
}

Status Materials::set_material(const PanelId& panel, std::optional<int> zone, const std::string& material) {
  if (!names_a_material(material))
    return Error{ErrorCode::kInvalidArgument, "a material needs a name of at most 60 characters"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    SQLite::Statement update(connection, zone ? "UPDATE zones SET material = ? WHERE panel = ? AND number = ?"
                                              : "UPDATE zones SET material = ? WHERE panel = ?");
    SQLite::bind(update, material, panel.value);
    if (zone) update.bind(3, *zone);
    if (update.exec() > 0) return Ok();
    if (zone) return no_such_zone(panel, *zone);
    return Error{ErrorCode::kNotFound,
                 fmt::format("the zones of panel {} are not known: scan its show face again", panel.value)};
  });
}

}  // namespace veneer::db
