#include "daemon/services/panel_label.h"

#include <cairo.h>
#include <qrencode.h>

#include <algorithm>
#include <memory>

#include "planner/pages/page_drawing.h"

namespace veneer::daemon {
namespace {

// In millimetres; y runs down, as cairo's does.
constexpr double kLabelWidth = 100, kLabelHeight = 62, kLabelMargin = 4;
constexpr double kCodeSide = 30;  // with the white that must be around it
constexpr double kHeadingSize = 8, kTextSize = 3.2;

struct CodeDeleter {
  void operator()(QRcode* code) const { QRcode_free(code); }
};

// Dark modules as squares, in rows that are one shape each: no seams between them on paper.
bool draw_code(cairo_t* context, const std::string& text) {
  const std::unique_ptr<QRcode, CodeDeleter> code(QRcode_encodeString(text.c_str(), 0, QR_ECLEVEL_M, QR_MODE_8, 1));
  if (!code) return false;
  constexpr int kQuiet = 4;  // modules of white around it, as the standard wants
  const double module = kCodeSide / (code->width + 2 * kQuiet);
  for (int row = 0; row < code->width; ++row)
    for (int column = 0; column < code->width; ++column) {
      int end = column;
      while (end < code->width && (code->data[row * code->width + end] & 1) != 0) ++end;
      if (end == column) continue;
      cairo_rectangle(context, (kQuiet + column) * module, (kQuiet + row) * module, (end - column) * module, module);
      column = end;
    }
  cairo_set_antialias(context, CAIRO_ANTIALIAS_NONE);
  cairo_fill(context);
  cairo_set_antialias(context, CAIRO_ANTIALIAS_DEFAULT);
  return true;
}

bool draw_whole(cairo_t* context, const PanelLabel& label) {
  if (!draw_code(context, label.panel)) return false;
  const double left = kCodeSide + 1, room = kLabelWidth - kLabelMargin - left;
  planner::show_text(context, label.panel, left, kLabelMargin + kHeadingSize * 0.8,
                     {kHeadingSize, planner::Weight::kBold, planner::Align::kLeft, room});
  double y = kLabelMargin + kHeadingSize + 4;
  for (const std::string& text : label.lines) {
    planner::show_text(context, text, left, y, {kTextSize, planner::Weight::kNormal, planner::Align::kLeft, room});
    y += kTextSize * 1.35;
  }
  const double top = std::max(kCodeSide, y - kTextSize);
  planner::show_picture(context, label.picture, kLabelMargin, top, kLabelWidth - 2 * kLabelMargin,
                        kLabelHeight - kLabelMargin - top);
  return cairo_status(context) == CAIRO_STATUS_SUCCESS;
}

}  // namespace

Result<std::string> draw_label(const PanelLabel& label, planner::PageFormat format) {
  planner::PrintedPage page(Millimetres(kLabelWidth), Millimetres(kLabelHeight), format);
  if (!draw_whole(page.context(), label)) return Error{ErrorCode::kInternal, "the label could not be drawn"};
  return page.finish();
}

}  // namespace veneer::daemon
