#include "planner/pages/page_drawing.h"

#include <cairo.h>

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};

// Sets the style's font; how far the text runs in it.
double set_font(cairo_t* context, const std::string& text, const TextStyle& style) {
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.weight == Weight::kBold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, style.size);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  if (extents.x_advance <= style.room) return extents.x_advance;
  cairo_set_font_size(context, style.size * style.room / extents.x_advance);
  return style.room;
}

}  // namespace

void show_text(cairo_t* context, const std::string& text, double x, double y, const TextStyle& style) {
  const double width = set_font(context, text, style);
  cairo_move_to(context, style.align == Align::kLeft ? x : x - (style.align == Align::kCentre ? width / 2 : width), y);
  cairo_show_text(context, text.c_str());
  cairo_new_path(context);
}

double text_width(cairo_t* context, const std::string& text, const TextStyle& style) {
  return set_font(context, text, style);
}

void show_picture(cairo_t* context, const cv::Mat& picture, double x, double y, double width, double height) {
  if (picture.empty()) return;
  cv::Mat pixels;
  cv::cvtColor(picture, pixels, cv::COLOR_BGR2BGRA);
  const std::unique_ptr<cairo_surface_t, SurfaceDeleter> image(cairo_image_surface_create_for_data(
      pixels.data, CAIRO_FORMAT_RGB24, pixels.cols, pixels.rows, static_cast<int>(pixels.step)));
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

}  // namespace veneer::planner
