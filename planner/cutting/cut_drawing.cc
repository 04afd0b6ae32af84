#include "planner/cutting/cut_drawing.h"

#include <fmt/format.h>

#include <cmath>

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

}  // namespace

std::vector<PathSegment> DrawnPath::segments() const {
  if (curved) return segments_of(path, closed);
  std::vector<PathSegment> out;
  for (std::size_t i = 1; i < path.size(); ++i) out.push_back({false, path[i], path[i], path[i]});
  return out;
}

Result<CutDrawing> draw_cuts(const Plan& plan, const PlanPanel& panel, Millimetres fit_clearance) {
  const auto bed_from_panel = back_view(panel);
  std::vector<ToolpathPiece> pieces;
  for (std::size_t i = 0; i < plan.pieces.size(); ++i)
    if (plan.pieces[i].placement && plan.pieces[i].placement->panel == panel.id)
      pieces.push_back(toolpath_piece(plan.pieces[i], i, bed_from_panel));
  ToolpathOptions options;
  options.fit_clearance = fit_clearance;
  options.recipe.kerf_back = options.recipe.kerf_show = plan.kerf;
  Result<Toolpath> toolpath = make_toolpath(pieces, options);
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

}  // namespace veneer::planner
