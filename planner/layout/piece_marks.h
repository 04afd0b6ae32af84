// What the pieces of a plan are marked with: where they belong (mark_of() in grid.h), or short marks that count them.
//
// All short marks of a plan are equally long, as short as its number of patches allows, and given in reading order,
// which is also ASCII's order: sorted as text they are in reading order. With patches of several sizes those of cells
// that lie within a larger patch are left out. Never given is a mark of nothing but signs whose shapes are the same in
// a mirror; nor, from three signs on, one that is the same backwards, of nothing but these and two that may be read as
// themselves there. The mirror image of another may still be read as a mark (docs/PLANNER.md). Pure; thread-safe.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "planner/layout/grid.h"
#include "planner/pictures/working_pictures.h"
#include "planner/plan.h"

namespace veneer::planner {

// The signs of short marks, in ASCII's order. Of two capitals or digits that Tesseract took for each other more than
// twice in some 590 readings of each, burnt by the twin, at most one is there (docs/PLANNER.md, short marks).
inline constexpr std::string_view kShortSigns = "12345678ACDEFHKLMNPRUVWXY";
// Those that look the same in a mirror.
inline constexpr std::string_view kMirrorSigns = "8AHMUVWXY";
// With those that Tesseract read as themselves in a mirror, between two of them.
inline constexpr std::string_view kNearMirrorSigns = "48AHMNUVWXY";

// Longer ones nobody reads: veneer-proof does not, nor does the console know them.
inline constexpr std::size_t kMostShortSigns = 4;

// How many marks of this many signs there are.
std::size_t short_mark_count(std::size_t signs);
// The first of them, as long as it takes.
std::vector<std::string> short_marks(std::size_t count);

class PieceMarks {
 public:
  PieceMarks() = default;
  // Of all patches that `artworks` may be cut into. kInvalidArgument: they are more than short marks name.
  static Result<PieceMarks> make(MarkKind kind, std::span<const Artwork> artworks, std::span<const WorkingArtwork> cut);

  std::string of(std::size_t artwork, const Patch& patch) const;

 private:
  std::vector<std::string> letters_;
  struct Counted {
    std::size_t first = 0, columns = 0;  // its first mark; of its grid
  };
  std::vector<Counted> artworks_;     // with short marks
  std::vector<std::string> counted_;  // short marks; none: marks tell places
};

// Whether it has the form of mark_of()'s: "A3-12" or "A312".
bool tells_place(std::string_view mark);

// What a plan's pieces would be marked with if marks told places, in their order.
std::vector<std::string> place_marks(const Plan& plan);
MarkKind mark_kind_of(const Plan& plan);

}  // namespace veneer::planner
