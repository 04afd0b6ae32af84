// The lists of an assembly map, in as many columns as a page is wide. Not for several threads at once on one page.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "planner/assembly/assembly_map.h"
#include "planner/assembly/map_drawing.h"

namespace veneer::planner {

struct MapListRow {
  std::vector<std::string> cells;  // one: a heading across the column
};

struct MapList {
  std::string title;
  std::vector<std::string> names;  // of the cells
  std::vector<double> widths;      // mm, of the cells
  std::vector<MapListRow> rows;
};

// By place, and in the order of cutting.
std::vector<MapList> lists_of(const AssemblyMap& map, const MapDrawing& drawing);

std::size_t rows_on_a_page(const MapList& list, const PageBox& room);
// The list's rows from `from` on, as many as `room` holds.
void draw_list(_cairo* context, const MapList& list, std::size_t from, const PageBox& room);

}  // namespace veneer::planner
