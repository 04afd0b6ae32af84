#include "daemon/calibration/pattern_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace veneer::daemon {
namespace {

Error refused(const std::string& why) { return {ErrorCode::kRefused, why}; }

std::string size_of(Millimetres width, Millimetres height) {
  return fmt::format("{:.0f} x {:.0f} mm", width.count(), height.count());
}

std::string say_so() { return fmt::format("say so with --confirm \"{}\"", kBoardOnTheBed); }
std::string say_both() { return fmt::format("{} --confirm \"{}\"", say_so(), kBoardNotSeen); }

// The bed's own frame or honeycomb may have this size, whichever way its sides are told.
bool is_as_large_as_the_bed(Millimetres width, Millimetres height, const Box<MachineFrame>& travel) {
  if (travel.empty()) return false;  // it is asked again once the laser has told its travel
  constexpr Millimetres kFrame{15};
  return std::max(width, height) >= std::max(travel.width(), travel.height()) - kFrame &&
         std::min(width, height) >= std::min(travel.width(), travel.height()) - kFrame;
}

// As told, or as seen: what is a little smaller than the bed may have been told a little smaller yet.
bool could_be_the_bed(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                      const Box<MachineFrame>& travel) {
  return is_as_large_as_the_bed(*board.width, *board.height, travel) ||
         std::ranges::any_of(found, [&](const calib::FoundBoard& one) {
           return is_as_large_as_the_bed(one.width, one.height, travel);
         });
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

Status require_size(const PatternBoard& board) {
  if (board.width && board.height) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               "the size of the board is needed, for the camera looks for a board of that size before anything is "
               "burnt: measure both its sides with a rule and give them with --board-width-mm and --board-height-mm"};
}

std::optional<calib::WantedBoard> wanted_board(const PatternBoard& board) {
  if (!board.width || !board.height) return std::nullopt;
  return calib::WantedBoard{*board.width, *board.height, board.thickness};
}

Status require_board(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                     const Box<MachineFrame>& travel,
                     const std::optional<Affine2<MachineFrame, BedFrame>>& machine_from_bed) {
  if (Status told = require_size(board); !told) return told;
  const std::string size = size_of(*board.width, *board.height);
  const std::string look = fmt::format(
      "look that it lies in the middle of the bed, within {:.0f} mm and {:.0f} degrees, its width along x, and ",
      kMostOffCentre.count(), kMostAskewDeg);
  const bool overruled = board.is_there && board.is_unseen;
  if (found.empty()) {
    if (overruled) return Ok();
    return refused(
        fmt::format("no board of {} is seen on the bed, and the pattern would be burnt into the bed or past "
                    "the board's edges: lay the bare board in the middle of the bed, all of it in the "
                    "camera's picture and none of it under the head, which veneerctl reset sends home, and tell its "
                    "size as it is; where it lies there and the camera does "
                    "not tell it from the bed, {}",
                    size, say_both()));
  }
  if (machine_from_bed && !travel.empty())
    if (Status measured = require_measured(board, found, travel, *machine_from_bed); !measured) return measured;
  if (could_be_the_bed(board, found, travel) && !overruled)
    return refused(
        fmt::format("a board of {} cannot be told from the bed, which is about as large: {}{}, or take a "
                    "smaller board",
                    size, look, say_both()));
  if (!machine_from_bed && !board.is_there)
    return refused(
        fmt::format("a board of {} is seen, but where the middle of the bed is nothing tells while the laser "
                    "has no valid calibration: {}{}",
                    size, look, say_so()));
  return Ok();
}

}  // namespace veneer::daemon
