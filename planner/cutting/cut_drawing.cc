#include "planner/cutting/cut_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "planner/cutting/toolpath.h"

namespace veneer::planner {
namespace {

// The panel turned about its vertical axis, as it lies on the bed: x = width - x.
Isometry2<BedFrame, PanelFrame> back_view(const PlanPanel& panel) {
  return {Radians(0), {panel.width, Millimetres(0)}, Handedness::kImproper};
}

ToolpathPiece toolpath_piece(const Piece& piece, std::size_t number,
                             const Isometry2<BedFrame, PanelFrame>& bed_from_panel) {
  const Isometry2<BedFrame, ArtworkFrame> bed_from_artwork = bed_from_panel * piece.placement->panel_from_artwork;
  const Point<BedFrame> foot = bed_from_artwork * Point<ArtworkFrame>{};
  const Point<BedFrame> head = bed_from_artwork * point<ArtworkFrame>(0, 1);
  ToolpathPiece out;
  out.piece = PieceId{static_cast<std::int64_t>(number) + 1};
  out.outline = bed_from_panel * piece.panel_outline();
  out.mark = piece.mark;
  out.artwork_up = Radians(std::atan2((head.y - foot.y).count(), (head.x - foot.x).count()));
  return out;
}

std::vector<ToolpathPiece> pieces_on(const PlanPanel& panel, const Plan& plan) {
  const auto bed_from_panel = back_view(panel);
  std::vector<ToolpathPiece> out;
  for (std::size_t i = 0; i < plan.pieces.size(); ++i)
    if (plan.pieces[i].placement && plan.pieces[i].placement->panel == panel.id)
      out.push_back(toolpath_piece(plan.pieces[i], i, bed_from_panel));
  return out;
}

ToolpathOptions cut_options(const Plan& plan) {
  ToolpathOptions out;
  out.recipe.kerf_back = out.recipe.kerf_show = plan.kerf;
  return out;
}

}  // namespace

std::vector<PathSegment> DrawnPath::segments() const {
  if (curved) return segments_of(path, closed);
  std::vector<PathSegment> out;
  for (std::size_t i = 1; i < path.size(); ++i) out.push_back({false, path[i], path[i], path[i]});
  return out;
}

Result<CutDrawing> draw_cuts(const Plan& plan, const PlanPanel& panel, Millimetres fit_clearance) {
  ToolpathOptions options = cut_options(plan);
  options.fit_clearance = fit_clearance;
  Result<Toolpath> toolpath = make_toolpath(pieces_on(panel, plan), options);
  if (!toolpath.ok()) return toolpath.error();

  CutDrawing drawing{fmt::format("Panel {}, seen from its back", panel.id.value),
                     panel.width,
                     panel.height,
                     {{"engrave", CutColour::kBlue, {}}, {"cut", CutColour::kRed, {}}},
                     std::move(toolpath->warnings),
                     toolpath->estimate};
  for (StrokeIn<BedFrame>& stroke : toolpath->strokes) {
    const bool closed = stroke.closed();
    if (closed) stroke.path.pop_back();
    const Piece& piece = plan.pieces[static_cast<std::size_t>(stroke.piece.value - 1)];
    const bool cut = stroke.role == StrokeRole::kCut;
    drawing.layers[cut ? 1 : 0].strokes.push_back({piece.mark, std::move(stroke.path), closed, cut});
  }
  return drawing;
}

Result<std::chrono::duration<double>> quick_estimate(const Plan& plan, const PlanPanel& panel) {
  std::vector<ToolpathPiece> pieces = pieces_on(panel, plan);
  if (pieces.empty()) return std::chrono::duration<double>(0);
  // Two pieces high: of those in a row each then lies near the one before it.
  const Box<BedFrame> first = bounds(pieces.front().outline);
  const Millimetres row_height = std::max(first.height() * 2, Millimetres(1));
  const auto place = [&](const ToolpathPiece& piece) {
    const Point<BedFrame> corner = bounds(piece.outline).min;
    const double row = std::floor(corner.y / row_height);
    const bool back = std::fmod(row, 2) != 0;
    return std::tuple(row, back ? -corner.x.count() : corner.x.count(), piece.piece.value);
  };
  std::sort(pieces.begin(), pieces.end(),
            [&](const ToolpathPiece& a, const ToolpathPiece& b) { return place(a) < place(b); });
  ToolpathOptions options = cut_options(plan);
  options.assembly_order = true;
  const Result<Toolpath> toolpath = make_toolpath(pieces, options);
  if (!toolpath.ok()) return toolpath.error();
  return toolpath->estimate;
}

}  // namespace veneer::planner
