// Sketches as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/job_wood_json.h"
#include "daemon/orders/records_json.h"
#include "daemon/orders/sketch_work.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DrawSketch, name, picture, crop, size, options, importance, kerf, wood, recipes,
                                   kept_dir, fine, large_edges, fine_edges, pinned_vertices, cell_sizes, flow_lines)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SketchDrawn, layout, width_mm, height_mm, patch_mm, pieces, unfilled, likeness,
                                   cutting_s, remarks, preview, left_out)

}  // namespace veneer::daemon
