#include "cli/csv.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string plain(const json& cell) {
  if (cell.is_null()) return "";
  if (cell.is_string()) return cell.get<std::string>();
  if (!cell.is_array()) return cell.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string all;
  for (const json& item : cell) all += (all.empty() ? "" : "; ") + plain(item);
  return all;
}

std::string quoted(std::string text) {
  constexpr std::string_view kFormulas = "=+-@\t\r";
  if (!text.empty() && kFormulas.find(text.front()) != std::string_view::npos) text.insert(0, 1, '\'');
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + '"';
}

}  // namespace

std::string csv_line(const std::vector<json>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) line += ',';
    line += cells[i].is_number() ? cells[i].dump() : quoted(plain(cells[i]));
  }
  return line + "\r\n";
}

}  // namespace veneer::cli
