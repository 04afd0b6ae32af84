#include "planner/layout/piece_marks.h"

#include <fmt/format.h>

#include <algorithm>

namespace veneer::planner {
namespace {

std::size_t power(std::size_t base, std::size_t exponent) {
  std::size_t out = 1;
  while (exponent-- > 0) out *= base;
  return out;
}

// From here on, marks that are the same backwards are looked at for near ones.
constexpr std::size_t kLeastNearMirror = 3;

bool reads_in_a_mirror(std::string_view mark) {
  if (mark.find_first_not_of(kMirrorSigns) == std::string_view::npos) return true;
  return mark.size() >= kLeastNearMirror && mark.find_first_not_of(kNearMirrorSigns) == std::string_view::npos &&
         std::equal(mark.begin(), mark.end(), mark.rbegin());
}

// Cells of the finest grid; 0 rows: the patches count themselves.
struct Extent {
  std::size_t rows = 0, columns = 0, patches = 0;
  std::size_t count() const { return rows > 0 ? rows * columns : patches; }
};

Extent extent_of(const std::vector<Patch>& patches) {
  Extent out;
  for (const Patch& patch : patches) {
    if (patch.number != Patch::kInGrid) {
      out.patches = std::max(out.patches, static_cast<std::size_t>(patch.number) + 1);
      continue;
    }
    out.rows = std::max(out.rows, static_cast<std::size_t>(patch.row + patch.cells));
    out.columns = std::max(out.columns, static_cast<std::size_t>(patch.column + patch.cells));
  }
  return out;
}

}  // namespace

std::size_t short_mark_count(std::size_t signs) {
  const std::size_t half = (signs + 1) / 2;  // which tells what is the same backwards
  const std::size_t near = power(kNearMirrorSigns.size(), half) - power(kMirrorSigns.size(), half);
  return power(kShortSigns.size(), signs) - power(kMirrorSigns.size(), signs) - (signs >= kLeastNearMirror ? near : 0);
}

std::vector<std::string> short_marks(std::size_t count) {
  std::size_t signs = 1;
  while (short_mark_count(signs) < count) ++signs;
  std::vector<std::string> out;
  out.reserve(count);
  for (std::size_t n = 0; out.size() < count; ++n) {
    std::string mark(signs, ' ');
    for (std::size_t k = signs, rest = n; k-- > 0; rest /= kShortSigns.size())
      mark[k] = kShortSigns[rest % kShortSigns.size()];
    if (!reads_in_a_mirror(mark)) out.push_back(std::move(mark));
  }
  return out;
}

Result<PieceMarks> PieceMarks::make(MarkKind kind, std::span<const Artwork> artworks,
                                    std::span<const WorkingArtwork> cut) {
  PieceMarks out;
  for (const Artwork& artwork : artworks) out.letters_.push_back(artwork.letter);
  if (kind == MarkKind::kPlace) return out;
  std::size_t count = 0;
  for (const WorkingArtwork& artwork : cut) {
    const Extent extent = extent_of(artwork.patches);
    out.artworks_.push_back({count, extent.columns});
    count += extent.count();
  }
  if (const std::size_t most = short_mark_count(kMostShortSigns); count > most)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there are {} patches, and short marks name {}: choose larger patches, or --marks place",
                             count, most)};
  out.counted_ = short_marks(count);
  return out;
}

std::string PieceMarks::of(std::size_t artwork, const Patch& patch) const {
  if (counted_.empty()) return mark_of(letters_[artwork], patch);
  const Counted& counted = artworks_[artwork];
  const bool in_grid = patch.number == Patch::kInGrid;
  const auto row = static_cast<std::size_t>(patch.row), column = static_cast<std::size_t>(patch.column);
  return counted_[counted.first + (in_grid ? row * counted.columns + column : static_cast<std::size_t>(patch.number))];
}

bool tells_place(std::string_view mark) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ", kDigits = "0123456789";
  const std::size_t letters = mark.find_first_not_of(kLetters);
  if (letters == 0 || letters == std::string_view::npos) return false;
  const std::string_view place = mark.substr(letters), row = place.substr(0, place.find('-'));
  const std::string_view column = row.size() < place.size() ? place.substr(row.size() + 1) : row;
  const auto counts = [&](std::string_view text) {
    return !text.empty() && text.find_first_not_of(kDigits) == std::string_view::npos;
  };
  return counts(row) && counts(column);
}

std::vector<std::string> place_marks(const Plan& plan) {
  std::vector<std::string> out;
  std::vector<int> numbers(plan.artworks.size(), 0);
  for (const Piece& piece : plan.pieces) {
    Patch patch;
    patch.row = piece.row, patch.column = piece.column;
    const int number = numbers[piece.artwork]++;
    if (piece.row == Piece::kNoRow) patch.number = number;
    out.push_back(mark_of(plan.artworks[piece.artwork].letter, patch));
  }
  return out;
}

MarkKind mark_kind_of(const Plan& plan) {
  // The first short mark begins with a digit, as none does that tells a place.
  return std::ranges::all_of(plan.pieces, tells_place, &Piece::mark) ? MarkKind::kPlace : MarkKind::kShort;
}

}  // namespace veneer::planner
