// What is engraved on the back of a piece: its mark in a single-line alphabet, over a baseline bar that tells 6 from 9.
// The alphabet is capitals, digits and '-'. Its shapes keep apart what readers mix up: 0 carries a slash, 1 a flag and
// a foot, I has two bars, 6 and 9 are bowls with open arms.
//
// A mark that does not fit on one line stands on two, broken before its hyphen or in its middle, over one bar. Where it
// has no room at a height that is read without effort, it moves closer to the outline first, then becomes smaller; at
// last only its ink, not the box around it, keeps away from the outline.
//
// Everything is laid out in BedFrame, after bed_from_panel: a panel lies with its back up, so text that reads from left
// to right in BedFrame, seen from above, reads right on the piece's back. Nothing here mirrors.
// Pure functions; thread-safe.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"

namespace veneer::planner {

// How far baselines stand above each other and the last one above the bar, in heights of a capital.
inline constexpr double kMarkLineStep = 8.2 / 6, kMarkBarDepth = 1.9 / 6;

struct MarkOptions {
  Millimetres height{2.4};       // of a capital, at most
  Millimetres good_height{2.0};  // what is read without effort; nothing smaller as long as there is another way
  Millimetres min_height{1.4};   // below it the mark is left out
  Millimetres margin{0.8};       // from ink to the outline
  Millimetres min_margin{0.4};   // where there is no room for it otherwise
};

struct Mark {
  std::vector<Polyline<BedFrame>> strokes;  // the bar is the last one, drawn from left to right
  std::vector<std::string> lines;           // the text as it stands on them, from top to bottom
  Millimetres height;                       // of a capital, as fitted
  Radians up;                               // direction of the text's up, counter-clockwise from +x
};

// `artwork_up` is where the artwork's up points in BedFrame, counter-clockwise from +x. The text's up is that
// direction; only when the mark does not fit so, on one line or on two, is it turned: by a quarter (left, right, then
// upside down), along the longest edges of the outline, then in steps of 15 degrees. kInvalidArgument for a character
// without a glyph; kRefused when the mark does not fit at the least height.
Result<Mark> lay_out_mark(std::string_view text, const Ring<BedFrame>& outline, Radians artwork_up,
                          const MarkOptions& options = {});

// Of smaller patches many shapes have no room for a mark (22 % of a mosaic's cells at 5 mm, 7 % at 6): they are cut
// without one. Layouts whose cells are free to grow give larger ones shapes that have.
inline constexpr Millimetres kLeastMarkedPatch{6};

// Whether a piece has room for this mark on its back, however it comes to lie on the bed; false for one that no mark
// can be.
bool has_room_for_mark(std::string_view text, const Ring<ArtworkFrame>& outline, const MarkOptions& options = {});
// The same with a little to spare, which whole micrometres may take: what layouts ask.
bool has_spare_room_for_mark(std::string_view text, const Ring<ArtworkFrame>& outline);

}  // namespace veneer::planner
