// Whether the bare board lies where the laser's pattern will be burnt. Pure.
//
// The pattern is burnt along the machine's axes around the middle of its travel, for a board that lies there within 20
// mm and 4 degrees. Where the machine's axes are known the board is measured; where they are not yet, a person who has
// looked says by name that the board that is seen lies there. A board that is not seen, or that may be the bed's own
// frame, takes a second word: one alone would burn an empty bed.
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
  std::optional<Millimetres> width, height;  // along x and y, as told
  bool is_there = false;                     // kBoardOnTheBed
  bool is_unseen = false;                    // kBoardNotSeen
};
PatternBoard with_confirmed(PatternBoard board, const std::vector<std::string>& confirmed);

// kInvalidArgument unless both sides are told: what nobody described is not looked for.
Status require_size(const PatternBoard& board);
// What is to be looked for, once its size is told.
std::optional<calib::WantedBoard> wanted_board(const PatternBoard& board);

// kRefused, saying what to do, unless the board lies there. `travel` is empty while the laser has not told it: where
// the middle of the bed is, and how large, is not asked then. `machine_from_bed` of axes that are in force; `found` is
// in the bed frame that it starts from, or in one that says nothing of the machine.
Status require_board(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                     const Box<MachineFrame>& travel,
                     const std::optional<Affine2<MachineFrame, BedFrame>>& machine_from_bed);

}  // namespace veneer::daemon
