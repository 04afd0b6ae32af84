// cut-<panel>.eps: Encapsulated PostScript with nothing but plain paths, which programs read that know little of it.
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "planner/cutting/cut_drawing.h"
#include "planner/cutting/plain_ascii.h"

namespace veneer::planner {
namespace {

constexpr double kPointsInAMillimetre = 72 / 25.4;
// Laser programs cut lines up to 0.025 mm wide and engrave wider ones as areas.
constexpr Millimetres kHairline(0.01);

double points(Millimetres length) { return length.count() * kPointsInAMillimetre; }

// What the exact box is to four decimals, rounded up.
double whole_points(double exact) { return std::ceil(exact - 0.00005); }

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : plain_ascii(text)) {
    if (c == '(' || c == ')' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

void put_layer(std::string& out, const CutLayer& layer) {
  const auto put = std::back_inserter(out);
  fmt::format_to(put, "% layer {}\n{} setrgbcolor\n", plain_ascii(layer.name),
                 layer.colour == CutColour::kBlue ? "0 0 1" : "1 0 0");
  for (const DrawnPath& stroke : layer.strokes) {
    fmt::format_to(put, "% piece {}\nnewpath\n", plain_ascii(stroke.piece));
    const auto at = [&](const Point<BedFrame>& p) { return fmt::format("{:.4f} {:.4f} ", points(p.x), points(p.y)); };
    out += at(stroke.path.front()) + "moveto\n";
    for (const PathSegment& segment : stroke.segments())
      if (segment.curved)
        out += at(segment.first) + at(segment.second) + at(segment.to) + "curveto\n";
      else if (!(stroke.closed && segment.to == stroke.path.front()))  // closepath goes back there
        out += at(segment.to) + "lineto\n";
    fmt::format_to(put, "{}stroke\n", stroke.closed ? "closepath " : "");
  }
}

}  // namespace

std::string cut_eps(const CutDrawing& drawing) {
  const double width = points(drawing.width), height = points(drawing.height);
  std::string out = fmt::format(
      "%!PS-Adobe-3.0 EPSF-3.0\n"
      "%%BoundingBox: 0 0 {:.0f} {:.0f}\n"
      "%%HiResBoundingBox: 0 0 {:.4f} {:.4f}\n"
      "%%Title: ({})\n"
      "%%Creator: veneerd\n"
      "%%LanguageLevel: 1\n"
      "%%EndComments\n"
      "gsave\n"
      "{:.4f} setlinewidth 1 setlinecap 1 setlinejoin\n",
      whole_points(width), whole_points(height), width, height, escaped(drawing.title), points(kHairline));
  for (const CutLayer& layer : drawing.layers) put_layer(out, layer);
  return out + "grestore\n%%EOF\n";
}

}  // namespace veneer::planner
