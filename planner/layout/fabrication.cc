#include "planner/layout/fabrication.h"

#include <algorithm>
#include <cmath>

#include "base/polygon_ops.h"

namespace veneer::planner {
namespace {

// How far the tip of a corner of 45 degrees sticks out of the body, in widths: (1 / sin 22.5 - 1) / 2.
constexpr double kTip = 0.8066;

// What whole micrometres may make of the area of an outline: none of its points moves by more than 0.71 um.
double rounding_of(const Ring<ArtworkFrame>& outline) {
  Millimetres around{0};
  for (std::size_t i = 0; i < outline.size(); ++i) around += distance(outline[i], outline[(i + 1) % outline.size()]);
  return around.count() * 0.00071;
}

bool is_level_rectangle(const Ring<ArtworkFrame>& outline) {
  if (outline.size() != 4) return false;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % 4];
    const bool level = i % 2 == (outline[0].y == outline[1].y ? 0U : 1U);
    if (level ? a.y != b.y : a.x != b.x) return false;
  }
  return signed_area(outline) > 0;
}

}  // namespace

std::string_view words_for(FabricationFault fault) {
  switch (fault) {
    case FabricationFault::kCrossesItself:
      return "is not one simple area";
    case FabricationFault::kTooSmall:
      return "is too small to be handled";
    case FabricationFault::kNeck:
      return "has a neck that would break";
    case FabricationFault::kThin:
      return "is too thin in places";
  }
  return "";
}

std::optional<FabricationFault> fault_of(const Ring<ArtworkFrame>& outline, const FabricationLimits& limits,
                                         std::vector<Point<ArtworkFrame>>* places) {
  if (is_level_rectangle(outline)) {  // whose sides say it all: no offsets are needed for a grid's thousands
    const Box<ArtworkFrame> box = bounds(outline);
    if (box.width() * box.height() < limits.area) return FabricationFault::kTooSmall;
    if (std::min(box.width(), box.height()) < limits.width) return FabricationFault::kThin;
    return std::nullopt;
  }
  const Region<ArtworkFrame> piece(outline);
  // A ring that crosses itself encloses some area twice or the wrong way round.
  constexpr SquareMillimetres kRounding{0.01};
  if (piece.micro_area().rings.size() != 1 ||
      std::abs(piece.area().count() - signed_area(outline)) > std::max(kRounding.count(), rounding_of(outline)))
    return FabricationFault::kCrossesItself;
  if (piece.area() < limits.area) return FabricationFault::kTooSmall;
  const Millimetres radius = limits.width / 2;
  const Region<ArtworkFrame> centres = offset(piece, radius * -1.0, Corners::kRound);
  if (centres.empty()) return FabricationFault::kThin;
  if (centres.micro_area().rings.size() != 1) return FabricationFault::kNeck;
  // The body grown by what may stick out.
  const Region<ArtworkFrame> reached = offset(centres, radius + limits.width * kTip, Corners::kRound);
  const Region<ArtworkFrame> tips = subtract(piece, reached);
  if (tips.area() > kRounding) {
    if (places != nullptr)
      for (const Ring<ArtworkFrame>& ring : tips.rings()) places->insert(places->end(), ring.begin(), ring.end());
    return FabricationFault::kThin;
  }
  return std::nullopt;
}

}  // namespace veneer::planner
