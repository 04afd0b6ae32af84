#include "daemon/calibration/fiducial_print.h"

#include <cairo.h>

#include "calib/tag_pattern.h"

namespace veneer::daemon {
namespace {

// Paper's y runs up, a page's down.
class SheetDrawing {
 public:
  SheetDrawing(cairo_t* context, const calib::FiducialSheet& sheet) : context_(context), sheet_(sheet) {}

  Status draw() const {
    for (const auto& tag : sheet_.tags)
      if (Status drawn = draw(tag); !drawn) return drawn;
    for (const auto& line : sheet_.lines) draw(line);
    for (const auto& circle : sheet_.circles) {
      cairo_set_line_width(context_, 0.2);
      cairo_new_sub_path(context_);
      cairo_arc(context_, x(circle.centre), y(circle.centre), circle.diameter.count() / 2, 0, kWholeTurn);
      cairo_stroke(context_);
    }
    for (const auto& text : sheet_.texts) draw(text);
    return Ok();
  }

 private:
  static constexpr double kWholeTurn = 6.283185307179586;
  using At = Point<PaperFrame>;
  double x(const At& p) const { return p.x.count(); }
  double y(const At& p) const { return (sheet_.height - p.y).count(); }

  // The black cells of a row that touch are one shape, and so are all rows: no seams between them on paper.
  Status draw(const calib::PrintedTag& tag) const {
    const auto pattern = calib::tag_pattern(tag.id);
    if (!pattern) return pattern.error();
    const double cell = tag.size.count() / calib::kTagSquareCells;
    const double half = cell * calib::TagPattern::kCells / 2;
    for (std::size_t row = 0; row < calib::TagPattern::kCells; ++row)
      for (std::size_t column = 0; column < calib::TagPattern::kCells; ++column) {
        std::size_t end = column;
        while (end < calib::TagPattern::kCells && pattern->black[row][end]) ++end;
        if (end == column) continue;
        cairo_rectangle(context_, x(tag.centre) - half + static_cast<double>(column) * cell,
                        y(tag.centre) - half + static_cast<double>(row) * cell,
                        static_cast<double>(end - column) * cell, cell);
        column = end;
      }
    cairo_fill(context_);
    return Ok();
  }

  void draw(const calib::PrintedLine& line) const {
    cairo_set_line_width(context_, line.width.count());
    for (const At& p : line.points) cairo_line_to(context_, x(p), y(p));
    cairo_stroke(context_);
  }

  void draw(const calib::PrintedText& text) const {
    cairo_select_font_face(context_, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(context_, text.size.count());
    cairo_text_extents_t extents;
    cairo_text_extents(context_, text.text.c_str(), &extents);
    cairo_move_to(context_, x(text.at) - (text.centred ? extents.x_advance / 2 : 0), y(text.at));
    cairo_show_text(context_, text.text.c_str());
  }

  cairo_t* context_;
  const calib::FiducialSheet& sheet_;
};

}  // namespace

Result<std::string> print_sheets(const std::vector<calib::FiducialSheet>& pages, planner::PageFormat format) {
  planner::PrintedPage page(pages.front().width, pages.front().height, format);
  for (std::size_t i = 0; i < pages.size() && (i == 0 || format == planner::PageFormat::kPdf); ++i) {
    if (i > 0) page.next_page();
    if (const Status drawn = SheetDrawing(page.context(), pages[i]).draw(); !drawn) return drawn.error();
  }
  return page.finish();
}

}  // namespace veneer::daemon
