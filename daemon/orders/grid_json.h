// Lines of grids and mosaics as JSON between the daemon and its worker processes, for the few sources that write or
// read it.
#pragma once

#include "daemon/orders/grid_work.h"
#include "daemon/orders/shapes_json.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawGrid, name, picture, crop, size, options, large_edges, fine_edges,
                                   pinned_vertices, fine, kept_dir)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GridDrawn, width_mm, height_mm, rows, columns, vertices, lines)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawMosaic, name, picture, crop, size, options, cell_sizes, flow_lines, importance,
                                   fine)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MosaicDrawn, width_mm, height_mm, cells, lines)

}  // namespace veneer::daemon
