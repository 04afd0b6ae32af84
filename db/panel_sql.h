// Reading steps that the stores share when they speak of panels. Private to db; these throw SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"

namespace veneer::db {

inline std::int64_t to_um(Millimetres length) { return std::llround(length.count() * 1000); }
inline Millimetres from_um(std::int64_t um) { return Millimetres(static_cast<double>(um) / 1000); }

// What a person counts; in UTF-8 a character's further bytes begin with the bits 10.
inline std::ptrdiff_t characters(const std::string& text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; });
}
inline bool names_a_material(const std::string& text) { return !text.empty() && characters(text) <= 60; }

inline Error no_such_panel(const PanelId& panel) {
  return {ErrorCode::kNotFound, fmt::format("there is no panel {}: see `veneerctl panel list`", panel.value)};
}

// Of the panel `p`.
constexpr const char* kIsInStock =
    "coalesce((SELECT retired FROM retirements WHERE panel = p.id ORDER BY id DESC LIMIT 1), 0) = 0";

inline bool panel_exists(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement row(connection, "SELECT 1 FROM panels WHERE id = ?");
  row.bind(1, panel.value);
  return row.executeStep();
}

}  // namespace veneer::db
