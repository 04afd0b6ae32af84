#include "planner/pages/printed_page.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include <cmath>

namespace veneer::planner {
namespace {

constexpr double kDotsPerMm = 300 / 25.4, kPointsPerMm = 72 / 25.4;

cairo_status_t append_bytes(void* to, const unsigned char* bytes, unsigned int length) {
  static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(bytes), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

struct PrintedPage::Canvas {
  struct SurfaceDeleter {
    void operator()(cairo_surface_t* of) const { cairo_surface_destroy(of); }
  };
  struct ContextDeleter {
    void operator()(cairo_t* of) const { cairo_destroy(of); }
  };
  std::string bytes;  // the surface writes into it, at its end as well
  std::unique_ptr<cairo_surface_t, SurfaceDeleter> surface;
  std::unique_ptr<cairo_t, ContextDeleter> context;
};

std::string content_type_of(PageFormat format) {
  switch (format) {
    case PageFormat::kSvg:
      return "image/svg+xml";
    case PageFormat::kPng:
      return "image/png";
    case PageFormat::kPdf:
      break;
  }
  return "application/pdf";
}

PageFormat page_format(const std::string& name) {
  return name == "svg" ? PageFormat::kSvg : name == "png" ? PageFormat::kPng : PageFormat::kPdf;
}

PrintedPage::PrintedPage(Millimetres width, Millimetres height, PageFormat format, Ground ground)
    : format_(format), ground_(ground), canvas_(std::make_unique<Canvas>()) {
  auto& [bytes, surface, context] = *canvas_;
  const double unit = format == PageFormat::kPng ? kDotsPerMm : kPointsPerMm;
  const double across = width.count() * unit, down = height.count() * unit;
  if (format == PageFormat::kPdf)
    surface.reset(cairo_pdf_surface_create_for_stream(append_bytes, &bytes, across, down));
  else if (format == PageFormat::kSvg)
    surface.reset(cairo_svg_surface_create_for_stream(append_bytes, &bytes, across, down));
  else
    surface.reset(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::lround(across)),
                                             static_cast<int>(std::lround(down))));
  context.reset(cairo_create(surface.get()));
  cairo_scale(context.get(), unit, unit);
  cairo_font_options_t* const options = cairo_font_options_create();
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_set_font_options(context.get(), options);
  cairo_font_options_destroy(options);
  clear();
}

PrintedPage::~PrintedPage() = default;

_cairo* PrintedPage::context() const { return canvas_->context.get(); }

void PrintedPage::clear() const {
  if (ground_ == Ground::kBare) return;
  cairo_set_source_rgb(context(), 1, 1, 1);
  cairo_paint(context());
  cairo_set_source_rgb(context(), 0, 0, 0);
}

void PrintedPage::next_page() {
  cairo_show_page(context());
  clear();
}

Result<std::string> PrintedPage::finish() {
  const Error failed{ErrorCode::kInternal, "the page could not be drawn"};
  if (cairo_status(context()) != CAIRO_STATUS_SUCCESS) return failed;
  if (format_ == PageFormat::kPng) {
    cairo_surface_flush(canvas_->surface.get());
    if (cairo_surface_write_to_png_stream(canvas_->surface.get(), append_bytes, &canvas_->bytes) !=
        CAIRO_STATUS_SUCCESS)
      return failed;
  }
  cairo_surface_finish(canvas_->surface.get());
  if (cairo_surface_status(canvas_->surface.get()) != CAIRO_STATUS_SUCCESS) return failed;
  return std::move(canvas_->bytes);
}

}  // namespace veneer::planner
