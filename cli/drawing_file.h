// A drawing's file, to be burnt as it is: an SVG's lines, or our own JSON of strokes (docs/LASER.md,
// docs/schemas/strokes.schema.json).
#pragma once

#include <string>

#include "base/result.h"
#include "planner/drawings/drawing.h"

namespace veneer::cli {

// By the file's name: .svg, else JSON. kInvalidArgument names what cannot be read.
Result<planner::Drawing> read_drawing(const std::string& name, const std::string& text);
Result<planner::Drawing> read_strokes(const std::string& text);

}  // namespace veneer::cli
