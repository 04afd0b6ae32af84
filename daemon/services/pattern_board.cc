#include "daemon/services/pattern_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace veneer::daemon {
namespace {

constexpr Millimetres kBesideBoard{30};  // of the travel, where nobody said how large the board is

Error refused(const std::string& why) { return {ErrorCode::kRefused, why}; }

std::string size_of(Millimetres width, Millimetres height) {
  return fmt::format("{:.0f} x {:.0f} mm", width.count(), height.count());
}

std::string say_so() { return fmt::format("say so with --confirm \"{}\"", kBoardOnTheBed); }

// The bed's own frame or honeycomb may have this size.
bool could_be_the_bed(const PatternBoard& board, const Box<MachineFrame>& travel) {
  constexpr Millimetres kFrame{15};
  return *board.width >= travel.width() - kFrame && *board.height >= travel.height() - kFrame;
}

// Of its middle to that of the travel.
struct Offset {
  Millimetres x, y;
  Millimetres length() const { return Millimetres(std::hypot(x.count(), y.count())); }
};

Offset off_centre(const calib::FoundBoard& found, const Box<MachineFrame>& travel,
                  const Affine2<MachineFrame, BedFrame>& machine_from_bed) {
  const Point<MachineFrame> centre = machine_from_bed * found.centre;
  return {centre.x - (travel.min.x + travel.max.x) / 2, centre.y - (travel.min.y + travel.max.y) / 2};
}

// "" where it lies well.
std::string why_misplaced(const calib::FoundBoard& found, const calib::WantedBoard& wanted, const Offset& off) {
  if (!calib::lies_as_wanted(found, wanted))
    return fmt::format(
        "the board lies the other way, {} where {} was told: turn it by 90 degrees, or tell its sides the "
        "other way round",
        size_of(found.width, found.height), size_of(wanted.width, wanted.height));
  if (off.length() <= kMostOffCentre && std::abs(found.turn_deg) <= kMostAskewDeg) return "";
  return fmt::format(
      "the board's middle lies {:.0f} mm too far to the {} and {:.0f} mm too far to the {}, and it is turned "
      "by {:.1f} degrees, so the pattern would be burnt past its edges: lay it in the middle, within "
      "{:.0f} mm and {:.0f} degrees",
      std::abs(off.x.count()), off.x < Millimetres(0) ? "left" : "right", std::abs(off.y.count()),
      off.y < Millimetres(0) ? "front" : "back", found.turn_deg, kMostOffCentre.count(), kMostAskewDeg);
}

Status require_measured(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                        const Box<MachineFrame>& travel, const Affine2<MachineFrame, BedFrame>& machine_from_bed) {
  const calib::WantedBoard wanted = *wanted_board(board);
  std::string why;
  Millimetres nearest{0};
  for (const calib::FoundBoard& one : found) {
    const Offset off = off_centre(one, travel, machine_from_bed);
    const std::string misplaced = why_misplaced(one, wanted, off);
    if (misplaced.empty()) return Ok();
    if (why.empty() || off.length() < nearest) why = misplaced, nearest = off.length();
  }
  return refused(why);
}

}  // namespace

PatternBoard with_confirmed(PatternBoard board, const std::vector<std::string>& confirmed) {
  board.is_there = std::ranges::count(confirmed, kBoardOnTheBed) > 0;
  board.is_unseen = std::ranges::count(confirmed, kBoardNotSeen) > 0;
  return board;
}

Status require_both_sides(const PatternBoard& board) {
  if (board.width.has_value() == board.height.has_value()) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               "only one side of the board is told: tell both, --board-width-mm and --board-height-mm, or neither for "
               "a board that nearly fills the bed"};
}

std::optional<calib::WantedBoard> wanted_board(const PatternBoard& board) {
  if (!board.width || !board.height) return std::nullopt;
  return calib::WantedBoard{*board.width, *board.height, board.thickness};
}

PatternBoard filled_in(PatternBoard board, const Box<MachineFrame>& travel) {
  if (!board.width) board.width = travel.width() - kBesideBoard;
  if (!board.height) board.height = travel.height() - kBesideBoard;
  return board;
}

Status require_board(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                     const Box<MachineFrame>& travel,
                     const std::optional<Affine2<MachineFrame, BedFrame>>& machine_from_bed) {
  if (const Status both = require_both_sides(board); !both) return both;
  const PatternBoard made_for = filled_in(board, travel);
  const std::string size = size_of(*made_for.width, *made_for.height);
  const std::string look = fmt::format(
      "look that it lies in the middle of the bed, within {:.0f} mm and {:.0f} degrees, its width along x, and ",
      kMostOffCentre.count(), kMostAskewDeg);
  if (!board.width) {
    if (board.is_there) return Ok();
    return refused(
        fmt::format("how large the board is nobody said, and the pattern would be made for one of {}: tell "
                    "its size with --board-width-mm and --board-height-mm, or, where it is that large, {}{}",
                    size, look, say_so()));
  }
  if (found.empty()) {
    if (board.is_there && board.is_unseen) return Ok();
    return refused(
        fmt::format("no board of {} is seen on the bed, and the pattern would be burnt into the bed or past "
                    "the board's edges: lay the bare board in the middle of the bed, all of it in the "
                    "camera's picture, and tell its size as it is; where it lies there and the camera does "
                    "not tell it from the bed, {} --confirm \"{}\"",
                    size, say_so(), kBoardNotSeen));
  }
  if (machine_from_bed)
    if (const Status measured = require_measured(board, found, travel, *machine_from_bed); !measured) return measured;
  if (board.is_there) return Ok();
  if (!machine_from_bed)
    return refused(
        fmt::format("a board of {} is seen, but where the middle of the bed is nothing tells while the laser "
                    "has no valid calibration: {}{}",
                    size, look, say_so()));
  if (could_be_the_bed(board, travel))
    return refused(
        fmt::format("a board of {} cannot be told from the bed, which is about as large: {}{}", size, look, say_so()));
  return Ok();
}

}  // namespace veneer::daemon
