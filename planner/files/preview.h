// The assembled picture, as it will lie on the table.
#pragma once

#include <span>

#include "planner/plan.h"

namespace veneer::planner {

// CV_8UC3, BGR; covers the artwork, its origin at the artwork's lower left corner. Colours are the panels' pictures;
// unfilled patches are magenta (255, 0, 255). Panels are found in `stock` by id.
// kNotFound: a piece's panel is not in `stock`. kInvalidArgument: no such artwork.
Result<Raster<ArtworkFrame>> assemble_preview(const Plan& plan, std::size_t artwork, std::span<const StockPanel> stock,
                                              ScanResolution resolution);

}  // namespace veneer::planner
