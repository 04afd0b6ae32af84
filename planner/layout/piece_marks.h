// What the pieces of a plan are marked with: where they belong (mark_of() in grid.h), or short marks that count them.
//
// All short marks of a plan are equally long, as short as its number of patches allows, and given in reading order,
// which is also ASCII's order: sorted as text they are in reading order. With patches of several sizes those of cells
// that lie within a larger patch are left out. A mark of nothing but signs that are the same in a mirror is never
// given. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "planner/layout/grid.h"
#include "planner/pictures/working_pictures.h"
#include "planner/plan.h"

namespace veneer::planner {

// The signs of short marks, in ASCII's order: no two are taken for each other where they are read from burnt wood
// (docs/PLANNER.md, short marks).
inline constexpr std::string_view kShortSigns = "12345678ACDEFHKLMNPRUVWXY";
// Those that look the same in a mirror.
inline constexpr std::string_view kMirrorSigns = "8AHMUVWXY";

// How many marks of this many signs there are.
std::size_t short_mark_count(std::size_t signs);
// The first of them, as long as it takes.
std::vector<std::string> short_marks(std::size_t count);

class PieceMarks {
 public:
  PieceMarks() = default;
  // Of all patches that `artworks` may be cut into.
  PieceMarks(MarkKind kind, std::span<const Artwork> artworks, std::span<const WorkingArtwork> cut);

  std::string of(std::size_t artwork, const Patch& patch) const;

 private:
  std::vector<std::string> letters_;
  struct Counted {
    std::size_t first = 0, columns = 0;  // its first mark; of its grid
  };
  std::vector<Counted> artworks_;     // with short marks
  std::vector<std::string> counted_;  // short marks; none: marks tell places
};

// "A" of "A3-12" or "A312"; empty: the mark does not tell a place as mark_of() does.
std::string_view letter_of_place(std::string_view mark);
inline bool tells_place(std::string_view mark) { return !letter_of_place(mark).empty(); }

// What a plan's pieces would be marked with if marks told places, in their order.
std::vector<std::string> place_marks(const Plan& plan);
MarkKind mark_kind_of(const Plan& plan);

}  // namespace veneer::planner
