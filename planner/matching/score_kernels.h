// The inner loop of the shortlist: one patch against many cells of a coarse map at once.
//
// Written for several instruction sets; the machine's best is chosen at start. Whole numbers only, so every machine
// gets the same result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace veneer::planner::kernels {

inline constexpr int kGroup = 16;  // neighbouring cells that are scored together

// The patch: one tap for every block of its window and pair of channels.
struct BlockTaps {
  const std::int32_t* taps;  // [pair][block row][block column]; two 16-bit weights, the first channel's low
  int pairs, rows, columns;
};

// Cells of one row of the map. Blocks are two cells wide, so block column k of a window is 2 * k cells on.
struct CellRow {
  const std::int16_t* const* blocks;  // [pair * taps.rows + block row]: two channels a cell
  const std::int32_t* offsets;        // one a cell
};

// For each group (its first cell, counted from the row's pointers): offset + sum over taps of tap * block, for
// kGroup cells, and one bit for each that is below `limit`. Sums must stay within 32 bits.
using ScoreGroups = void (*)(const BlockTaps& taps, const CellRow& row, const std::uint32_t* groups, std::size_t count,
                             std::int32_t limit, std::int32_t* scores, std::uint16_t* below);
extern const ScoreGroups score_groups;

// All versions that this machine can run, the plain one first and the best last; for tests and measurements.
struct ScoreVersion {
  const char* name;
  ScoreGroups run;
};
std::vector<ScoreVersion> score_versions();

}  // namespace veneer::planner::kernels
