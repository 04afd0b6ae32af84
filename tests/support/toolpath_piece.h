#pragma once

#include <string>
#include <utility>

#include "planner/cutting/toolpath.h"

namespace veneer::planner::test {

inline ToolpathPiece toolpath_piece(std::int64_t id, Ring<BedFrame> outline, std::string mark = "") {
  ToolpathPiece piece;
  piece.piece = PieceId{id};
  piece.outline = std::move(outline);
  piece.mark = std::move(mark);
  return piece;
}

}  // namespace veneer::planner::test
