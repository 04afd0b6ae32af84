// About where the cells of a mosaic will lie, while somebody paints their sizes, draws lines along which they lie, or
// moves a slider.
#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

#include "base/geometry.h"
#include "planner/plan.h"
#include "planner/suggest/grid_sketch.h"

namespace veneer::planner {

struct MosaicPreview {
  std::size_t cells = 0;
  std::vector<Polyline<ArtworkFrame>> lines;  // the borders between two cells, each once
};

// PlanOptions::layout_fineness of rough cells, where there are about so many.
double rough_fineness(double patches);

// `options` are those of the plan to come, with the layout kMosaic; `artwork.guides` what somebody says of its cells.
// kFine has about the plan's own cells where there are at most some 700: the same if the artwork has the plan's
// picture, of a smaller one edges lie a little elsewhere. kCoarse, and kFine of more, have about as many, as large and
// turned alike, but others. kInvalidArgument: as make_plan, another layout, or there would be more cells than
// kMostSketchedCells. kCancelled: a stop was requested. Deterministic.
Result<MosaicPreview> sketch_mosaic(const Artwork& artwork, const PlanOptions& options, GridEffort effort,
                                    const std::stop_token& stop = {});

}  // namespace veneer::planner
