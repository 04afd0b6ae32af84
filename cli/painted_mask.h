// What somebody painted over a picture in a program for pictures, as the API takes it: WIDTHxHEIGHT:HEX, cells over the
// whole picture (or its crop), row by row from its upper left corner.
//
// A PNG file of any size without transparency, stretched over the picture. kNotFound or kInvalidArgument name the file
// and say what to do. Pure but for reading it.
#pragma once

#include <string>

#include "base/result.h"

namespace veneer::cli {

// White where the picture matters most, black where not at all: a digit for each cell.
Result<std::string> importance_from_picture(const std::string& file);

// White where a mosaic's cells are small, black where they are large: a digit for each cell of the mask.
Result<std::string> sizes_from_picture(const std::string& file);

// White where edges count, black where not: four cells in a digit.
Result<std::string> edges_from_picture(const std::string& file);

}  // namespace veneer::cli
