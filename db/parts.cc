#include <fmt/format.h>

#include <algorithm>

#include "db/panel_sql.h"
#include "db/part_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

Region<PanelFrame> moved(const Region<PanelFrame>& area, const Isometry2<PanelFrame, PanelFrame>& map) {
  MicroArea out;
  for (const auto& ring : area.rings()) out.rings.push_back(to_micro(map * ring));
  return Region<PanelFrame>(micro::unite(out, {}));
}

bool touch(const Box<PanelFrame>& a, const Box<PanelFrame>& b, Millimetres apart) {
  return a.min.x <= b.max.x + apart && b.min.x <= a.max.x + apart && a.min.y <= b.max.y + apart &&
         b.min.y <= a.max.y + apart;
}

void carry_facts(SQLite::Database& connection, const PanelId& parent, const PanelId& part) {
  // Where the parent lay is not where its parts do.
  SQLite::Statement thickness(connection,
                              "INSERT INTO panel_facts (panel, veneer_um, substrate_um, who, at) SELECT ?, veneer_um, "
                              "substrate_um, who, at FROM (SELECT * FROM panel_facts WHERE panel = ? ORDER BY id DESC "
                              "LIMIT 1) WHERE veneer_um IS NOT NULL OR substrate_um IS NOT NULL");
  SQLite::bind(thickness, part.value, parent.value);
  thickness.exec();
  SQLite::Statement surface(connection,
                            "INSERT INTO treatments (panel, kind, product, treated_at, who, at) SELECT ?, kind, "
                            "product, treated_at, who, at FROM treatments WHERE panel = ? ORDER BY id");
  SQLite::bind(surface, part.value, parent.value);
  surface.exec();
}

}  // namespace

std::vector<Gone> gone_from(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement rows(connection,
                         "SELECT a.id, a.state, a.reason, a.area_um, a.outline_um, a.job, t.mark, a.lead_in_um FROM "
                         "allocations AS a LEFT JOIN pieces AS p ON p.id = a.piece LEFT JOIN patches AS t ON t.id = "
                         "p.patch WHERE a.panel = ? AND a.state <> 'released' ORDER BY a.id");
  rows.bind(1, panel.value);
  std::vector<Gone> out;
  while (rows.executeStep()) {
    const auto area = read_area(text(rows.getColumn(3))), lead_in = read_area(text(rows.getColumn(7)));
    const auto outline = read_outline(text(rows.getColumn(4)));
    if (!area || !outline || !lead_in) throw damaged("an allocation of panel " + panel.value);
    std::string reason = text(rows.getColumn(2));
    if (const auto mark = text_or_null(rows.getColumn(6)))
      reason = fmt::format("piece {} of job {}, of panel {}", *mark, rows.getColumn(5).getInt64(), panel.value);
    out.push_back({rows.getColumn(0).getInt64(), text(rows.getColumn(1)), std::move(reason), Region<PanelFrame>(*area),
                   from_micro<PanelFrame>(*outline), Region<PanelFrame>(*lead_in)});
  }
  return out;
}

void book_carried(SQLite::Database& connection, const PanelId& panel, const Gone& wood, const Region<PanelFrame>& area,
                  const Isometry2<PanelFrame, PanelFrame>& map, const std::string& at) {
  SQLite::Statement book(connection,
                         "INSERT INTO allocations (panel, state, area_um, outline_um, lead_in_um, reason, changed_at) "
                         "VALUES (?, ?, ?, ?, ?, ?, ?)");
  const auto lead_in = wood.lead_in.empty() ? wood.lead_in : intersect(moved(wood.lead_in, map), area);
  SQLite::bind(book, panel.value, wood.state, write_area(area.micro_area()),
               write_outline(to_micro(map * wood.outline)), write_area(lead_in.micro_area()), wood.reason, at);
  book.exec();
  SQLite::Statement origin(connection, "INSERT INTO carried (allocation, origin) VALUES (?, ?)");
  SQLite::bind(origin, connection.getLastInsertRowid(), wood.allocation);
  origin.exec();
}

std::vector<Region<PanelFrame>> moved_apart(const std::vector<Region<PanelFrame>>& areas,
                                            const Isometry2<PanelFrame, PanelFrame>& map,
                                            const Region<PanelFrame>& within) {
  constexpr Millimetres kRounding{0.003};
  std::vector<Region<PanelFrame>> out;
  std::vector<Box<PanelFrame>> boxes;
  for (const auto& area : areas) {
    auto here = intersect(moved(area, map), within);
    const auto box = bounds_of(here);
    std::vector<Region<PanelFrame>> near;
    bool overlapping = false;
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (here.empty() || out[i].empty() || !touch(box, boxes[i], kRounding * 2)) continue;
      near.push_back(out[i]);
      overlapping = overlapping || overlaps(here, out[i]);
    }
    if (overlapping) here = subtract(here, offset(unite(near), kRounding, Corners::kRound));
    boxes.push_back(bounds_of(here));
    out.push_back(std::move(here));
  }
  return out;
}

void carry_over(SQLite::Database& connection, const PanelRecord& panel, const PartRecord& part, const std::string& at) {
  SQLite::Statement entered(connection,
                            "INSERT INTO parts (panel, angle_rad, shift_x_mm, shift_y_mm, improper, fiducials, rms_mm) "
                            "VALUES (?, ?, ?, ?, ?, ?, ?)");
  entered.bind(1, panel.id.value);
  bind_isometry(entered, 2, part.part_from_parent);
  entered.bind(6, part.fiducials);
  entered.bind(7, part.rms.count());
  entered.exec();

  const auto gone = gone_from(connection, *panel.parent);
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(gone.size());
  for (const Gone& wood : gone) areas.push_back(wood.area);
  const Ring<PanelFrame> sheet{{Millimetres(0), Millimetres(0)},
                               {panel.width, Millimetres(0)},
                               {panel.width, panel.height},
                               {Millimetres(0), panel.height}};
  const auto carried = moved_apart(areas, part.part_from_parent, Region<PanelFrame>(sheet));
  for (std::size_t i = 0; i < gone.size(); ++i)
    if (!carried[i].empty()) book_carried(connection, panel.id, gone[i], carried[i], part.part_from_parent, at);
  carry_facts(connection, *panel.parent, panel.id);
}

}  // namespace veneer::db
