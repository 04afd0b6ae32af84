#include "daemon/services/panel_label.h"

#include <cairo.h>
#include <qrencode.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

namespace veneer::daemon {
namespace {

// In millimetres; y runs down, as cairo's does.
constexpr double kLabelWidth = 100, kLabelHeight = 62, kLabelMargin = 4;
constexpr double kCodeSide = 30;  // with the white that must be around it
constexpr double kHeadingSize = 8, kTextSize = 3.2;

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct CodeDeleter {
  void operator()(QRcode* code) const { QRcode_free(code); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;

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

void draw_text(cairo_t* context, const std::string& text, double x, double y, double size, double room) {
  cairo_set_font_size(context, size);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  if (extents.x_advance > room) cairo_set_font_size(context, size * room / extents.x_advance);
  cairo_move_to(context, x, y);
  cairo_show_text(context, text.c_str());
}

// As large as the box allows, in its middle.
void draw_picture(cairo_t* context, const cv::Mat& picture, double x, double y, double width, double height) {
  if (picture.empty()) return;
  cv::Mat pixels;
  cv::cvtColor(picture, pixels, cv::COLOR_BGR2BGRA);
  const Surface image(cairo_image_surface_create_for_data(pixels.data, CAIRO_FORMAT_RGB24, pixels.cols, pixels.rows,
                                                          static_cast<int>(pixels.step)));
  const double scale = std::min(width / pixels.cols, height / pixels.rows);
  cairo_save(context);
  cairo_translate(context, x + (width - scale * pixels.cols) / 2, y + (height - scale * pixels.rows) / 2);
  cairo_scale(context, scale, scale);
  cairo_set_source_surface(context, image.get(), 0, 0);
  cairo_rectangle(context, 0, 0, pixels.cols, pixels.rows);
  cairo_fill(context);
  // What is drawn later must not look at pixels that are gone by then.
  cairo_surface_flush(cairo_get_target(context));
  cairo_restore(context);
}

bool draw_whole(cairo_t* context, const PanelLabel& label) {
  if (!draw_code(context, label.panel)) return false;
  const double left = kCodeSide + 1, room = kLabelWidth - kLabelMargin - left;
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
  draw_text(context, label.panel, left, kLabelMargin + kHeadingSize * 0.8, kHeadingSize, room);
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  double y = kLabelMargin + kHeadingSize + 4;
  for (const std::string& text : label.lines) {
    draw_text(context, text, left, y, kTextSize, room);
    y += kTextSize * 1.35;
  }
  const double top = std::max(kCodeSide, y - kTextSize);
  draw_picture(context, label.picture, kLabelMargin, top, kLabelWidth - 2 * kLabelMargin,
               kLabelHeight - kLabelMargin - top);
  return cairo_status(context) == CAIRO_STATUS_SUCCESS;
}

}  // namespace

Result<std::string> draw_label(const PanelLabel& label, PageFormat format) {
  PrintedPage page(Millimetres(kLabelWidth), Millimetres(kLabelHeight), format);
  if (!draw_whole(page.context(), label)) return Error{ErrorCode::kInternal, "the label could not be drawn"};
  return page.finish();
}

}  // namespace veneer::daemon
