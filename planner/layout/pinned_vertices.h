// Where two lines of a picture's grid are to meet, as somebody says it: in a file of guides, and in one parameter of a
// plan. Pure; thread-safe.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"

namespace veneer::planner {

// Rows of vertices are counted from 0, the artwork's upper border, columns from 0, its left border, so that piece row
// r, column c (counted from 0) has the vertices r and r + 1, c and c + 1.
struct PinnedVertex {
  int row = 0, column = 0;
  Point<ArtworkFrame> at;
};

inline constexpr std::size_t kMostPinnedVertices = 200;

// ROW,COLUMN,X,Y in millimetres from the artwork's lower left corner, separated by semicolons; "": none.
// kInvalidArgument: `name` must be such a list.
Result<std::vector<PinnedVertex>> pinned_vertices_of(std::string_view name, std::string_view text);

}  // namespace veneer::planner
