// Whether the bare board lies where the laser's pattern will be burnt. Pure.
//
// The pattern is burnt along the machine's axes around the middle of its travel, for a board that lies there within 20
// mm and 4 degrees. Where the machine's axes are known the board is measured; where they are not yet, or nobody said
// how large it is, what is seen proves nothing, and a person who has looked says so by name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/geometry.h"
#include "base/result.h"
#include "base/units.h"
#include "calib/board_finder.h"
#include "daemon/unit/confirmations.h"

namespace veneer::daemon {

inline constexpr Millimetres kMostOffCentre{20};
inline constexpr double kMostAskewDeg = 4;

// As the operator measured it, and what the operator confirms of it.
struct PatternBoard {
  Millimetres thickness{0};
  std::optional<Millimetres> width, height;  // along x and y; neither: it nearly fills the bed
  bool is_there = false;                     // kBoardOnTheBed
  bool is_unseen = false;                    // kBoardNotSeen
};
PatternBoard with_confirmed(PatternBoard board, const std::vector<std::string>& confirmed);

// kInvalidArgument where one side is told without the other.
Status require_both_sides(const PatternBoard& board);
// What is to be looked for; nothing where nobody said how large it is.
std::optional<calib::WantedBoard> wanted_board(const PatternBoard& board);
// How large the pattern is made for.
PatternBoard filled_in(PatternBoard board, const Box<MachineFrame>& travel);

// kRefused, saying what to do, unless the board lies there. `machine_from_bed` of axes that are in force; `found` is in
// the bed frame that it starts from, or in one that says nothing of the machine.
Status require_board(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                     const Box<MachineFrame>& travel,
                     const std::optional<Affine2<MachineFrame, BedFrame>>& machine_from_bed);

}  // namespace veneer::daemon
