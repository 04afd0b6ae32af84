// cut-<panel>.svg.
#include <fmt/format.h>

#include <pugixml.hpp>
#include <sstream>

#include "planner/cutting/cut_drawing.h"

namespace veneer::planner {
namespace {

std::string path_data(const DrawnPath& stroke, Millimetres panel_height) {
  const auto at = [&](const Point<BedFrame>& p) {
    return fmt::format("{:.3f},{:.3f} ", p.x.count(), (panel_height - p.y).count());
  };
  std::string data = "M" + at(stroke.path.front());
  for (const PathSegment& segment : stroke.segments())
    if (segment.curved)
      data += "C" + at(segment.first) + at(segment.second) + at(segment.to);
    else if (!(stroke.closed && segment.to == stroke.path.front()))  // Z goes back there
      data += "L" + at(segment.to);
  if (stroke.closed)
    data += "Z";
  else
    data.pop_back();
  return data;
}

void add_layer(pugi::xml_node svg, const CutLayer& layer, Millimetres panel_height) {
  pugi::xml_node group = svg.append_child("g");
  group.append_attribute("id") = layer.name.c_str();
  group.append_attribute("inkscape:groupmode") = "layer";
  group.append_attribute("inkscape:label") = layer.name.c_str();
  group.append_attribute("fill") = "none";
  group.append_attribute("stroke") = layer.colour == CutColour::kBlue ? "#0000ff" : "#ff0000";
  group.append_attribute("stroke-width") = "0.1";
  for (const DrawnPath& stroke : layer.strokes) {
    pugi::xml_node path = group.append_child("path");
    path.append_attribute("data-piece") = stroke.piece.c_str();
    path.append_attribute("d") = path_data(stroke, panel_height).c_str();
  }
}

}  // namespace

std::string cut_svg(const CutDrawing& drawing) {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  pugi::xml_node svg = document.append_child("svg");
  svg.append_attribute("xmlns") = "http://www.w3.org/2000/svg";
  svg.append_attribute("xmlns:inkscape") = "http://www.inkscape.org/namespaces/inkscape";
  svg.append_attribute("version") = "1.1";
  const std::string width = fmt::format("{:.3f}", drawing.width.count()),
                    height = fmt::format("{:.3f}", drawing.height.count());
  svg.append_attribute("width") = (width + "mm").c_str();
  svg.append_attribute("height") = (height + "mm").c_str();
  svg.append_attribute("viewBox") = fmt::format("0 0 {} {}", width, height).c_str();
  svg.append_child("title").text() = drawing.title.c_str();
  for (const CutLayer& layer : drawing.layers) add_layer(svg, layer, drawing.height);
  std::ostringstream out;
  document.save(out, " ");
  return out.str();
}

}  // namespace veneer::planner
