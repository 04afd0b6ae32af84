#include "planner/edits/plan_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "planner/layout/piece_marks.h"

namespace veneer::planner {
namespace {

Result<Piece*> find_piece(Plan& plan, const std::string& mark) {
  for (Piece& piece : plan.pieces)
    if (piece.mark == mark) return &piece;
  return Error{ErrorCode::kNotFound, fmt::format("the plan that is kept has no piece {}", mark)};
}

Result<Piece*> find_placed(Plan& plan, const std::string& mark) {
  Result<Piece*> piece = find_piece(plan, mark);
  if (piece.ok() && !(*piece)->placement)
    return Error{ErrorCode::kInvalidArgument, fmt::format("piece {} has no wood in the plan that is kept", mark)};
  return piece;
}

// Where a piece lies before it is moved; none: it has no wood.
void note_place(const Plan& plan, const std::string& mark, std::map<std::string, std::optional<Placement>>& places) {
  const auto piece = std::ranges::find(plan.pieces, mark, &Piece::mark);
  if (piece != plan.pieces.end()) places.emplace(mark, piece->placement);
}

bool has_no_rows(const Plan& plan, std::size_t artwork) {
  return std::any_of(plan.pieces.begin(), plan.pieces.end(),
                     [&](const Piece& piece) { return piece.artwork == artwork && piece.row == Piece::kNoRow; });
}

Point<ArtworkFrame> centre(const Piece& piece) {
  const Box<ArtworkFrame> box = bounds(piece.artwork_outline);
  return {(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2};
}

// Where `piece` lies when it is centred on the spot of `at` and turned like it.
Placement placement_at(const Piece& piece, const Piece& at) {
  const auto& there = at.placement->panel_from_artwork;
  const Point<PanelFrame> spot = there * centre(at);
  const double cos = std::cos(there.angle().count()), sin = std::sin(there.angle().count());
  const double x = centre(piece).x.count(), y = centre(piece).y.count();
  const Isometry2<PanelFrame, ArtworkFrame> map{
      there.angle(), point<PanelFrame>(spot.x.count() - (cos * x - sin * y), spot.y.count() - (sin * x + cos * y))};
  return {at.placement->panel, map};
}

}  // namespace

Result<ForbiddenWood> forbidden_wood(const std::string& text) {
  constexpr double kFarthest = 1e6;
  const auto unusable = [&](const char* what) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{} {}", text, what)};
  };
  double mm[4] = {};
  std::string_view left = text;
  for (int k = 3; k >= 0; --k) {
    const std::size_t comma = left.rfind(',');
    if (comma == std::string_view::npos) return unusable("is not PANEL,X,Y,WIDTH,HEIGHT in millimetres");
    const std::string_view number = left.substr(comma + 1);
    const auto [end, fault] = std::from_chars(number.data(), number.data() + number.size(), mm[k]);
    if (fault != std::errc() || end != number.data() + number.size() || !(std::abs(mm[k]) <= kFarthest))
      return unusable("is not PANEL,X,Y,WIDTH,HEIGHT in millimetres");
    left = left.substr(0, comma);
  }
  if (!(mm[2] > 0 && mm[3] > 0)) return unusable("has no area");
  ForbiddenWood out{{std::string(left)}, {}};
  out.region.add(point<PanelFrame>(mm[0], mm[1]));
  out.region.add(point<PanelFrame>(mm[0] + mm[2], mm[1] + mm[3]));
  return out;
}

Status forbid(std::span<StockPanel> stock, const PanelId& panel, const Box<PanelFrame>& region) {
  for (StockPanel& it : stock) {
    if (!(it.id == panel)) continue;
    double left = 0, top = 0, right = 0, bottom = 0;
    it.free.to_pixels({region.min.x, region.max.y}, left, top);
    it.free.to_pixels({region.max.x, region.min.y}, right, bottom);
    // Every pixel that the region touches.
    const cv::Rect touched(cv::Point(static_cast<int>(std::floor(left)), static_cast<int>(std::floor(top))),
                           cv::Point(static_cast<int>(std::ceil(right)), static_cast<int>(std::ceil(bottom))));
    it.free.pixels = it.free.pixels.clone();
    const cv::Rect inside = touched & cv::Rect({0, 0}, it.free.pixels.size());
    if (inside.empty())
      return Error{ErrorCode::kInvalidArgument, fmt::format("the forbidden region lies beside panel {}", panel.value)};
    it.free.pixels(inside).setTo(0);
    return Ok();
  }
  return Error{ErrorCode::kNotFound, fmt::format("there is no panel {} to forbid wood on", panel.value)};
}

Status swap_pieces(Plan& plan, const std::string& one, const std::string& other) {
  const Result<Piece*> a = find_placed(plan, one), b = find_placed(plan, other);
  if (!a.ok()) return a.error();
  if (!b.ok()) return b.error();
  Placement of_a = placement_at(**a, **b), of_b = placement_at(**b, **a);
  (*a)->placement = std::move(of_a), (*b)->placement = std::move(of_b);
  return Ok();
}

Status take_alternative(Plan& plan, const std::string& mark, std::size_t number) {
  const Result<Piece*> piece = find_piece(plan, mark);
  if (!piece.ok()) return piece.error();
  const std::vector<Alternative>& listed = (*piece)->alternatives;
  if (number < 1 || number > listed.size())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("piece {} has {} alternatives in the plan that is kept, none is number {}", mark,
                             listed.size(), number)};
  (*piece)->placement = listed[number - 1].placement;
  return Ok();
}

Result<std::vector<KeptPiece>> kept_pieces(const Plan& plan, Keep keep, std::span<const std::string> must,
                                           std::span<const std::string> replanned) {
  const std::set<std::string> staying(must.begin(), must.end()), going(replanned.begin(), replanned.end());
  std::set<std::string> unknown = staying;
  unknown.insert(going.begin(), going.end());
  std::vector<KeptPiece> out;
  std::vector<std::string> places;
  if (mark_kind_of(plan) == MarkKind::kShort) places = place_marks(plan);
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
    const Piece& piece = plan.pieces[i];
    unknown.erase(piece.mark);
    const bool stays = staying.count(piece.mark) != 0, goes = going.count(piece.mark) != 0;
    if (stays && goes)
      return Error{ErrorCode::kInvalidArgument, fmt::format("piece {} cannot stay and be planned anew", piece.mark)};
    if (stays && !piece.placement)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("piece {} has no wood in the plan that is kept", piece.mark)};
    KeptPiece& kept = out.emplace_back(KeptPiece{piece.mark, piece.cells, {}, stays, {}});
    if (!places.empty()) kept.short_mark = std::exchange(kept.mark, places[i]);
    if (!plan.layouts.empty()) kept.outline = piece.artwork_outline;
    if (!piece.placement || goes || (keep == Keep::kOnly && !stays)) continue;
    kept.placement = piece.placement;
  }
  if (!unknown.empty())
    return Error{ErrorCode::kNotFound, fmt::format("the plan that is kept has no piece {}", *unknown.begin())};
  return out;
}

Status keep_edited(Plan plan, const PlanEdits& edits, PlanOptions& options) {
  std::vector<std::string> staying = edits.pins;
  std::map<std::string, std::optional<Placement>> moved_from;
  for (const auto& [one, other] : edits.swaps) note_place(plan, one, moved_from), note_place(plan, other, moved_from);
  for (const auto& take : edits.takes) note_place(plan, take.first, moved_from);
  for (const auto& [one, other] : edits.swaps) {
    if (Status swapped = swap_pieces(plan, one, other); !swapped.ok()) return swapped;
    staying.push_back(one), staying.push_back(other);
  }
  for (const auto& [mark, number] : edits.takes) {
    if (Status taken = take_alternative(plan, mark, number); !taken.ok()) return taken;
    staying.push_back(mark);
  }
  auto kept = kept_pieces(plan, edits.pins.empty() ? Keep::kAll : Keep::kOnly, staying, edits.replanned);
  if (!kept.ok()) return kept.error();
  options.kept = std::move(*kept);
  options.marks = mark_kind_of(plan);
  for (KeptPiece& piece : options.kept)
    if (const auto from = moved_from.find(piece.marked()); from != moved_from.end())
      piece.moved = true, piece.moved_from = from->second;
  if (edits.held)
    for (KeptPiece& piece : options.kept) piece.held = piece.must = piece.placement.has_value();
  // What it refined stays as it is.
  if (!plan.layouts.empty()) options.refine = Refine::kNone;
  options.kept_layouts.clear();
  for (std::size_t a = 0; a < plan.layouts.size(); ++a)
    options.kept_layouts.push_back({plan.artworks[a].letter, plan.layouts[a], has_no_rows(plan, a)});
  for (const KeptPiece& piece : options.kept)
    options.adaptive_levels =
        std::max(options.adaptive_levels, static_cast<int>(std::bit_width(static_cast<unsigned>(piece.cells))) - 1);
  return Ok();
}

}  // namespace veneer::planner
