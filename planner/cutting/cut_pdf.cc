// cut-<panel>.pdf: nothing but hairlines on a page as large as the panel.
#include <cairo.h>

#include "planner/cutting/curve_segments.h"
#include "planner/cutting/cut_drawing.h"
#include "planner/pages/printed_page.h"

namespace veneer::planner {

std::string cut_pdf(const CutDrawing& drawing) {
  PrintedPage page(drawing.width, drawing.height, PageFormat::kPdf, PrintedPage::Ground::kBare);
  cairo_t* const context = page.context();
  // Laser programs cut lines up to 0.025 mm wide and engrave wider ones as areas.
  cairo_set_line_width(context, 0.01);
  const auto x = [&](const Point<BedFrame>& p) { return p.x.count(); };
  const auto y = [&](const Point<BedFrame>& p) { return (drawing.height - p.y).count(); };
  for (const CutLayer& layer : drawing.layers) {
    if (layer.colour == CutColour::kBlue)
      cairo_set_source_rgb(context, 0, 0, 1);
    else
      cairo_set_source_rgb(context, 1, 0, 0);
    for (const DrawnPath& stroke : layer.strokes) {
      if (stroke.path.empty()) continue;
      cairo_move_to(context, x(stroke.path.front()), y(stroke.path.front()));
      for (const PathSegment& segment : stroke.segments())
        if (segment.curved)
          cairo_curve_to(context, x(segment.first), y(segment.first), x(segment.second), y(segment.second),
                         x(segment.to), y(segment.to));
        else
          cairo_line_to(context, x(segment.to), y(segment.to));
      if (stroke.closed) cairo_close_path(context);
      cairo_stroke(context);
    }
  }
  auto file = page.finish();
  return file ? std::move(*file) : std::string();  // cairo has nothing that could fail here but memory
}

}  // namespace veneer::planner
