// cut-<panel>.svg: what a laser has to do to a panel that lies on its face.
#include <fmt/format.h>

#include <pugixml.hpp>
#include <sstream>

#include "planner/cutting/toolpath.h"
#include "planner/plan_files.h"

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
  out.outline = bed_from_panel * piece.placement->panel_outline;
  out.mark = piece.mark;
  out.artwork_up = Radians(std::atan2((head.y - foot.y).count(), (head.x - foot.x).count()));
  return out;
}

std::string path_data(const ToolpathStroke& stroke, Millimetres panel_height) {
  std::string data;
  const std::size_t points = stroke.path.size() - (stroke.closed ? 1 : 0);
  for (std::size_t i = 0; i < points; ++i)
    data += fmt::format("{}{:.3f},{:.3f} ", i == 0 ? "M" : "L", stroke.path[i].x.count(),
                        (panel_height - stroke.path[i].y).count());
  if (stroke.closed)
    data += "Z";
  else
    data.pop_back();
  return data;
}

pugi::xml_node add_layer(pugi::xml_node svg, const char* name, const char* colour) {
  pugi::xml_node layer = svg.append_child("g");
  layer.append_attribute("id") = name;
  layer.append_attribute("inkscape:groupmode") = "layer";
  layer.append_attribute("inkscape:label") = name;
  layer.append_attribute("fill") = "none";
  layer.append_attribute("stroke") = colour;
  layer.append_attribute("stroke-width") = "0.1";
  return layer;
}

}  // namespace

Result<CutDrawing> cut_svg(const Plan& plan, const PlanPanel& panel, Millimetres fit_clearance) {
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

  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  pugi::xml_node svg = document.append_child("svg");
  svg.append_attribute("xmlns") = "http://www.w3.org/2000/svg";
  svg.append_attribute("xmlns:inkscape") = "http://www.inkscape.org/namespaces/inkscape";
  svg.append_attribute("version") = "1.1";
  const std::string width = fmt::format("{:.3f}", panel.width.count()),
                    height = fmt::format("{:.3f}", panel.height.count());
  svg.append_attribute("width") = (width + "mm").c_str();
  svg.append_attribute("height") = (height + "mm").c_str();
  svg.append_attribute("viewBox") = fmt::format("0 0 {} {}", width, height).c_str();
  svg.append_child("title").text() = fmt::format("Panel {}, seen from its back", panel.id.value).c_str();
  pugi::xml_node engrave = add_layer(svg, "engrave", "#0000ff");
  pugi::xml_node cut = add_layer(svg, "cut", "#ff0000");
  for (const ToolpathStroke& stroke : toolpath->strokes) {
    pugi::xml_node path = (stroke.role == ToolpathRole::kCut ? cut : engrave).append_child("path");
    const auto piece = static_cast<std::size_t>(stroke.piece.value - 1);
    path.append_attribute("data-piece") = plan.pieces[piece].mark.c_str();
    path.append_attribute("d") = path_data(stroke, panel.height).c_str();
  }
  std::ostringstream out;
  document.save(out, " ");
  return CutDrawing{out.str(), std::move(toolpath->warnings)};
}

}  // namespace veneer::planner
