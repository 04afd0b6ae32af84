#include "planner/layout/pinned_vertices.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

namespace veneer::planner {
namespace {

// Reads the number that `text` begins with, and takes it away, with the comma behind it unless it is the last.
template <class Number>
bool take_number(std::string_view& text, Number& value, bool last) {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (last) return text.empty();
  if (!text.starts_with(',')) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<PinnedVertex> pinned_vertex(std::string_view text) {
  int row = 0, column = 0;
  double x = 0, y = 0;
  if (!take_number(text, row, false) || !take_number(text, column, false) || !take_number(text, x, false) ||
      !take_number(text, y, true) || row < 0 || column < 0 || !std::isfinite(x) || !std::isfinite(y))
    return std::nullopt;
  return PinnedVertex{row, column, {Millimetres(x), Millimetres(y)}};
}

}  // namespace

Result<std::vector<PinnedVertex>> pinned_vertices_of(std::string_view name, std::string_view text) {
  std::vector<PinnedVertex> out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(';'), text.size());
    const auto vertex = pinned_vertex(text.substr(0, end));
    if (!vertex)
      return unusable(fmt::format("{} must be a list of ROW,COLUMN,X,Y separated by semicolons, not \"{}\": correct it",
                                  name, text.substr(0, std::min<std::size_t>(end, 40))));
    if (out.size() == kMostPinnedVertices)
      return unusable(fmt::format("{} has more than {} vertices: pin those that matter", name, kMostPinnedVertices));
    out.push_back(*vertex);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

}  // namespace veneer::planner
