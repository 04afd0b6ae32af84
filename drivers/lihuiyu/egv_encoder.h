// Writes strokes as LHYMICRO-GL, the language of Lihuiyu boards.
//
// A program burns consecutive strokes of one piece that share speed and power:
//
//   I                   forget everything
//   CV...               speed code (speed_code.h)
//   T|zR100 ...         dark way to the first stroke, in default mode: the board's own rapid speed
//   NRBS1E              compact mode; the directions are now +y and +x, x engaged, beam off
//   D U                 beam on, beam off
//   B T R L M           +x, -x, +y (down), -y, both at once; a letter engages its axis
//   a..z | 000          distance: a..y = 1..25, |a..|z = 26..51, z = 255, or three digits; they add up and are moved
//                       when the next letter comes
//   FNSE                finished: the board reports it when all motion is done
//
// Programs for the wire are written in packets of 30 characters. A packet that burns begins by switching the beam on
// and ends by switching it off, so that the beam is out whenever the board runs out of packets: the link may die at any
// moment. And it carries at most `packet_motion_s` of motion in compact mode; the rest is filled with U, which changes
// nothing.
//
// Power: an M3 has a register for it, set before the program (packet.h). An M2 has none, its tube burns with the
// current set at the panel: there the beam is on for the wanted share of the steps, in whole pulses of a step, evenly
// spread over each pass of a stroke with half a gap at both ends. At a fifth of the power a mark is a row of dots 5
// mils (0.13 mm) apart.
//
// Pure functions; thread-safe.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/laser_job.h"
#include "drivers/lihuiyu/mil_path.h"

namespace veneer::lihuiyu {

enum class Board { kM2, kM3 };

inline constexpr std::size_t kPayloadBytes = 30;

struct EncoderOptions {
  Board board = Board::kM2;
  // Of motion at program speed in one packet. 0: as dense as possible and not laid out in packets, for files.
  double packet_motion_s = 0.1;
};

struct Program {
  std::string text;
  std::optional<int> power_permille;  // M3: to be set before the program
  MilPoint begin, start, end;         // of the dark way, of the first stroke, of the last
  double length_mm = 0;               // of all its motion, the dark way's too, each axis for itself
  double shortest_s = 0;  // no board executes it faster: steps in compact mode at full speed, nothing for the rest
  std::size_t first_stroke = 0, stroke_count = 0;  // of the job
};

// All strokes of one piece. The head stands at `at`; `first` is the index of the first stroke in the job.
std::vector<Program> write_programs(std::span<const Stroke> strokes, std::size_t first, MilPoint at,
                                    const MilGrid& grid, const EncoderOptions& options);

// A whole job as an .egv file, from the home corner, as one program whose speed changes on the way. Power is always
// written as on an M2.
std::string write_egv(const LaserJob& job, const MilGrid& grid);

// Checks the job whole, before any byte of it is sent: places, speeds, powers, order. The sentence names the stroke.
Status check_job(const LaserJob& job, const MilGrid& grid);

// "|c", "zz100".
std::string distance_code(std::int64_t mils);

}  // namespace veneer::lihuiyu
