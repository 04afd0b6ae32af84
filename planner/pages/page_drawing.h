// Texts and pictures on a page that is drawn in millimetres, y running down (printed_page.h). Not for several threads
// at once on one page.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

struct _cairo;  // NOLINT(bugprone-reserved-identifier): cairo_t, for those who do not draw

namespace veneer::planner {

enum class Weight { kNormal, kBold };
enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  double size = 3.2;  // mm from line to line, without leading
  Weight weight = Weight::kNormal;
  Align align = Align::kLeft;
  double room = 1e9;  // mm; what is wider is set smaller
};

// Its baseline begins, is centred or ends at (x, y). UTF-8.
void show_text(_cairo* context, const std::string& text, double x, double y, const TextStyle& style = {});
double text_width(_cairo* context, const std::string& text, const TextStyle& style = {});

// CV_8UC3, as large as the box allows, in its middle; nothing of an empty picture.
void show_picture(_cairo* context, const cv::Mat& picture, double x, double y, double width, double height);

}  // namespace veneer::planner
