// Tables for spreadsheets and other programs: CSV by RFC 4180, UTF-8, lines that end with CR LF. Pure.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace veneer::cli {

// One line. Texts are quoted where they must be. One that a spreadsheet would take for a formula (it begins with = + -
// @, a tab or CR) gets a ' before it: whoever names a panel "=HYPERLINK(...)" makes nobody's spreadsheet do anything.
// Numbers are written as they are; null is an empty cell, a list its items with "; " between.
std::string csv_line(const std::vector<nlohmann::json>& cells);

}  // namespace veneer::cli
