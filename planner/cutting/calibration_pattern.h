// Lays out the calibration pattern (base/calibration_pattern.h).
//
//  - Rings fill the area up to 6 mm from its edge, columns x rows. Their diameter is 4 mm, that of the three key rings
//    8 mm: lattice places (0, 0), (columns - 1, 0) and (1, rows - 1).
//  - Even: about 40 mm apart. Uneven: about 24 mm in the mean, 14 mm at least, what is over shared out by the fractions
//    of multiples of the golden ratio, which keep from each other; so what comes again every 30 to 52 mm is met at many
//    phases (15 to 26 teeth on a belt of 2 mm; shorter turns less so).
//  - Kerf lines have 20 mm, four parallel to x and four parallel to y, each four unevenly spaced (6, 7 and 8 mm) and at
//    least 5 mm clear of every ring. The x lines lie in the middle lattice cell of the lowest row of cells, the y lines
//    in the cell right of it, each at least 35 mm wide and high.
//
// Pure functions; thread-safe.
#pragma once

#include <vector>

#include "base/calibration_pattern.h"
#include "base/result.h"
#include "base/stroke.h"
#include "planner/cutting/recipe.h"

namespace veneer::planner {

// kInvalidArgument when the area is too small: for 3 x 3 even rings with the kerf lines between them (about 82 x 82
// mm), or for uneven ones that span more than kLeastRingSpan both ways (more than 92 x 92 mm).
Result<CalibrationPattern> make_pattern(const PatternLayout& layout);

// Rings first, engraved, kerf lines last, cut, in a short order; speeds and powers are the recipe's, in one pass.
// Circles are flattened to 2 um.
std::vector<Stroke> pattern_strokes(const CalibrationPattern& pattern, const Recipe& recipe);

}  // namespace veneer::planner
