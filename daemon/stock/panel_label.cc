#include "daemon/stock/panel_label.h"

#include <cairo.h>
#include <qrencode.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>

#include "calib/tag_pattern.h"
#include "planner/pages/page_drawing.h"

namespace veneer::daemon {
namespace {

// In millimetres; y runs down, as cairo's does.
constexpr double kLabelWidth = 100, kLabelHeight = 62, kLabelMargin = 4;
constexpr double kCodeSide = 30;   // with the white that must be around it
constexpr double kTagSide = 22.5;  // below the code
constexpr double kHeadingSize = 8, kTextSize = 3.2;

struct CodeDeleter {
  void operator()(QRcode* code) const { QRcode_free(code); }
};

// Dark cells as squares, in rows that are one shape each: no seams between them on paper.
template <class IsDark>
void draw_cells(cairo_t* context, double left, double top, double cell, int count, const IsDark& is_dark) {
  for (int row = 0; row < count; ++row)
    for (int column = 0; column < count; ++column) {
      int end = column;
      while (end < count && is_dark(row, end)) ++end;
      if (end == column) continue;
      cairo_rectangle(context, left + column * cell, top + row * cell, (end - column) * cell, cell);
      column = end;
    }
  cairo_set_antialias(context, CAIRO_ANTIALIAS_NONE);
  cairo_fill(context);
  cairo_set_antialias(context, CAIRO_ANTIALIAS_DEFAULT);
}

bool draw_code(cairo_t* context, const std::string& text) {
  const std::unique_ptr<QRcode, CodeDeleter> code(QRcode_encodeString(text.c_str(), 0, QR_ECLEVEL_M, QR_MODE_8, 1));
  if (!code) return false;
  constexpr int kQuiet = 4;  // modules of white around it, as the standard wants
  const double module = kCodeSide / (code->width + 2 * kQuiet);
  draw_cells(context, kQuiet * module, kQuiet * module, module, code->width,
             [&](int row, int column) { return (code->data[row * code->width + column] & 1) != 0; });
  return true;
}

// 17 of "P-0017".
std::optional<int> number_of(const std::string& panel) {
  int number = 0;
  const char* const end = panel.data() + panel.size();
  if (!panel.starts_with("P-") || std::from_chars(panel.data() + 2, end, number).ptr != end) return std::nullopt;
  return number;
}

void draw_tag(cairo_t* context, const std::string& panel) {
  const auto number = number_of(panel);
  const auto tag = calib::label_tag_pattern(number.value_or(-1));
  if (!tag) return;
  constexpr auto kCells = calib::LabelTagPattern::kCells;
  draw_cells(
      context, (kCodeSide - kTagSide) / 2, kLabelHeight - kLabelMargin - kTagSide, kTagSide / kCells, kCells,
      [&](int row, int column) { return tag->black[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)]; });
}

bool draw_whole(cairo_t* context, const PanelLabel& label) {
  if (!draw_code(context, label.panel)) return false;
  draw_tag(context, label.panel);
  const double left = kCodeSide + 1, room = kLabelWidth - kLabelMargin - left;
  planner::show_text(context, label.panel, left, kLabelMargin + kHeadingSize * 0.8,
                     {kHeadingSize, planner::Weight::kBold, planner::Align::kLeft, room});
  double y = kLabelMargin + kHeadingSize + 4;
  for (const std::string& text : label.lines) {
    planner::show_text(context, text, left, y, {kTextSize, planner::Weight::kNormal, planner::Align::kLeft, room});
    y += kTextSize * 1.35;
  }
  const double top = std::max(kCodeSide, y - kTextSize);
  planner::show_picture(context, label.picture, left, top, room, kLabelHeight - kLabelMargin - top);
  return cairo_status(context) == CAIRO_STATUS_SUCCESS;
}

}  // namespace

Result<std::string> draw_label(const PanelLabel& label, planner::PageFormat format) {
  planner::PrintedPage page(Millimetres(kLabelWidth), Millimetres(kLabelHeight), format);
  if (!draw_whole(page.context(), label)) return Error{ErrorCode::kInternal, "the label could not be drawn"};
  return page.finish();
}

}  // namespace veneer::daemon
