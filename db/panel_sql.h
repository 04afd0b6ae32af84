// Steps that the stores share when they speak of panels. Private to db; these throw SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "base/utf8.h"
#include "db/panels.h"

namespace veneer::db {

inline std::int64_t to_um(Millimetres length) { return std::llround(length.count() * 1000); }
inline Millimetres from_um(std::int64_t um) { return Millimetres(static_cast<double>(um) / 1000); }

inline bool names_a_material(const std::string& text) { return !text.empty() && characters(text) <= 60; }

inline Error no_such_panel(const PanelId& panel) {
  return {ErrorCode::kNotFound, fmt::format("there is no panel {}: see `veneerctl panel list`", panel.value)};
}

// A scan that began while the panel was in stock.
inline Error retired_meanwhile(const PanelId& panel) {
  return {
      ErrorCode::kConflict,
      fmt::format("panel {0} was retired: run `veneerctl panel restore {0}`, or scan the sheet again as a new panel",
                  panel.value)};
}

// Of the panel `p`.
constexpr const char* kIsInStock =
    "coalesce((SELECT retired FROM retirements WHERE panel = p.id ORDER BY id DESC LIMIT 1), 0) = 0";

inline bool panel_exists(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement row(connection, "SELECT 1 FROM panels WHERE id = ?");
  row.bind(1, panel.value);
  return row.executeStep();
}

// Of a panel that left the stock; true too where there is no such panel.
inline bool is_retired(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement row(connection, std::string("SELECT 1 FROM panels AS p WHERE id = ? AND ") + kIsInStock);
  row.bind(1, panel.value);
  return !row.executeStep();
}

std::optional<SquareMillimetres> area_or_null(const SQLite::Column& um2);
void insert_mask(SQLite::Database& connection, const PanelId& panel, const MaskRecord& mask);
void insert_scans(SQLite::Database& connection, const std::vector<ScanRecord>& scans);
// Of faces that are frozen already, too.
void insert_fiducials(SQLite::Database& connection, const PanelId& panel, const std::vector<FiducialRecord>& fiducials);
// As Panels::retire.
Status leave_stock(SQLite::Database& connection, const PanelId& panel, const std::string& reason,
                   const std::string& at);
// A panel that the sheet does not come from, under whose name wood of it was booked. A part's wood of before is that of
// the panels it comes from, which are told with the part.
std::optional<std::string> booked_under(SQLite::Database& connection, const PanelId& panel);
std::optional<PanelId> merged_into(SQLite::Database& connection, const PanelId& panel);

}  // namespace veneer::db
