#include "planner/assembly/map_lists.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "planner/pages/page_drawing.h"

namespace veneer::planner {
namespace {

constexpr double kRow = 4, kRowText = 2.8, kBetween = 6, kTitle = 9;  // mm

double width_of(const MapList& list) {
  double width = 0;
  for (const double cell : list.widths) width += cell;
  return width;
}

std::size_t columns_on_a_page(const MapList& list, const PageBox& room) {
  const double columns = std::floor((room.width + kBetween) / (width_of(list) + kBetween));
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::max(0.0, columns)));
}

// Without the title and the cells' names.
std::size_t rows_in_a_column(const PageBox& room) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::max(0.0, (room.height - kTitle - kRow) / kRow)));
}

}  // namespace

std::vector<MapList> lists_of(const AssemblyMap& map, const MapDrawing& drawing) {
  const std::set<std::size_t> shown(drawing.pieces().begin(), drawing.pieces().end());
  std::map<std::size_t, std::string> numbers;
  MapList by_cutting{"In the order of cutting", {"no.", "mark", "square"}, {9, 15, 10}, {}};
  for (const CutSequence& sequence : map.sequences) {
    by_cutting.rows.push_back({{sequence.title}});
    std::size_t number = 0;
    for (const std::size_t i : sequence.pieces) {
      numbers[i] = std::to_string(++number);
      if (shown.count(i) > 0) by_cutting.rows.push_back({{numbers[i], map.plan.pieces[i].mark, drawing.square_of(i)}});
    }
    if (by_cutting.rows.back().cells.size() == 1) by_cutting.rows.pop_back();
  }
  MapList by_place{"By place: marks count in reading order of the finished picture",
                   {"mark", "square", "panel", "no."},
                   {15, 10, 18, 8},
                   {}};
  for (const std::size_t i : drawing.pieces()) {
    const Piece& piece = map.plan.pieces[i];
    const auto number = numbers.find(i);
    by_place.rows.push_back({{piece.mark, drawing.square_of(i), piece.placement ? piece.placement->panel.value : "none",
                              number == numbers.end() ? "" : number->second}});
  }
  return {std::move(by_place), std::move(by_cutting)};
}

std::size_t rows_on_a_page(const MapList& list, const PageBox& room) {
  return columns_on_a_page(list, room) * rows_in_a_column(room);
}

void draw_list(cairo_t* context, const MapList& list, std::size_t from, const PageBox& room) {
  const std::size_t down = rows_in_a_column(room), end = std::min(list.rows.size(), from + rows_on_a_page(list, room));
  cairo_set_source_rgb(context, 0, 0, 0);
  show_text(context, from == 0 ? list.title : list.title + " (continued)", room.x, room.y + 4.5,
            {4, Weight::kBold, Align::kLeft, room.width});
  for (std::size_t i = from; i < end; ++i) {
    const std::size_t column = (i - from) / down, row = (i - from) % down;
    const double left = room.x + static_cast<double>(column) * (width_of(list) + kBetween);
    const double top = room.y + kTitle, y = top + kRow * static_cast<double>(row + 2) - 1.1;
    const auto put = [&](const std::vector<std::string>& cells, double baseline, Weight weight) {
      double x = left;
      for (std::size_t k = 0; k < cells.size(); x += list.widths[k++])
        show_text(context, cells[k], x, baseline, {kRowText, weight, Align::kLeft, list.widths[k] - 1});
    };
    if (row == 0) {
      cairo_set_source_rgb(context, 0.35, 0.35, 0.35);
      put(list.names, top + kRow - 1.1, Weight::kNormal);
      cairo_set_source_rgb(context, 0, 0, 0);
    }
    const std::vector<std::string>& cells = list.rows[i].cells;
    if (cells.size() == 1) {
      show_text(context, cells.front(), left, y, {kRowText, Weight::kBold, Align::kLeft, width_of(list)});
      continue;
    }
    if (row % 2 == 1) {  // to keep to one's line
      cairo_set_source_rgb(context, 0.94, 0.94, 0.94);
      cairo_rectangle(context, left - 1, y - kRow + 1.1, width_of(list) + 2, kRow);
      cairo_fill(context);
      cairo_set_source_rgb(context, 0, 0, 0);
    }
    put(cells, y, Weight::kNormal);
  }
}

}  // namespace veneer::planner
