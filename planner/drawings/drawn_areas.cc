#include "planner/drawings/drawn_areas.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/drawings/drawing.h"
#include "planner/pictures/pictures.h"

namespace veneer::planner {
namespace {

constexpr double kDrawnSide = 2000;    // pixels of the longer side
constexpr double kClosedWithin = 0.1;  // mm between the ends of a line that is closed
constexpr int kPointBits = 4;          // bits behind the point of drawn coordinates

// XML, after the mark of its encoding and blanks: no picture begins so.
bool is_drawing(std::string_view bytes) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
  const std::size_t at = bytes.find_first_not_of(" \t\r\n");
  return at != std::string_view::npos && bytes[at] == '<';
}

// There, and perhaps back: it has no inside, whoever closes it.
bool is_stroke(const DrawnLine& line) {
  const auto& points = line.points;
  return points.size() < 3 || (points.size() == 3 && points.front() == points.back());
}

// Whether its inside is a region: a viewer closes what is filled.
bool encloses(const DrawnLine& line) {
  if (line.filled) return true;
  const DrawingPoint &a = line.points.front(), &b = line.points.back();
  return std::hypot(a[0] - b[0], a[1] - b[1]) <= kClosedWithin;
}

}  // namespace

Result<cv::Mat> areas_of_file(std::string_view bytes, const std::string& name) {
  if (!is_drawing(bytes)) return decode_picture(bytes, name);
  Result<cv::Mat> areas = areas_of_svg(std::string(bytes));
  if (!areas.ok()) return Error{areas.error().code, fmt::format("{}: {}", name, areas.error().message)};
  return areas;
}

Result<cv::Mat> areas_of_svg(const std::string& text) {
  Result<Drawing> drawing = read_svg(text);
  if (!drawing.ok()) return drawing.error();
  std::erase_if(drawing->lines, is_stroke);
  if (std::ranges::none_of(drawing->lines, encloses))
    return Error{ErrorCode::kInvalidArgument,
                 "the drawing has no closed region: close the paths whose insides are pieces"};
  const auto open = std::ranges::find_if_not(drawing->lines, encloses);
  if (open != drawing->lines.end())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the line of the drawing that begins at {:.2f}, {:.2f} mm encloses nothing: close it or "
                             "fill it, so that its inside is a piece, or take it out",
                             open->points.front()[0], open->points.front()[1])};
  const DrawingExtent extent = extent_of(*drawing);
  const double width = extent.max_x - extent.min_x, height = extent.max_y - extent.min_y;
  if (!is_finite(*drawing) || !std::isfinite(width + height))
    return Error{ErrorCode::kInvalidArgument, "the drawing is larger than can be measured: draw it again, smaller"};
  const double scale = kDrawnSide / std::max(width, height);
  if (!(std::min(width, height) * scale >= 2))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the drawing is only {:.2f} x {:.2f} mm large: draw regions, not lines", width, height)};
  cv::Mat out(cvRound(height * scale), cvRound(width * scale), CV_8UC3, cv::Scalar::all(0));
  for (std::size_t i = 0; i < drawing->lines.size(); ++i) {
    std::vector<cv::Point> ring;
    for (const DrawingPoint& p : drawing->lines[i].points)
      // Pixel centres lie at whole numbers to OpenCV.
      ring.emplace_back(cvRound(((p[0] - extent.min_x) * scale - 0.5) * (1 << kPointBits)),
                        cvRound(((extent.max_y - p[1]) * scale - 0.5) * (1 << kPointBits)));
    const std::size_t number = i + 1;
    const cv::Scalar colour(static_cast<double>(number & 255U), static_cast<double>(number >> 8U & 255U),
                            static_cast<double>(number >> 16U & 255U));
    cv::fillPoly(out, std::vector<std::vector<cv::Point>>{ring}, colour, cv::LINE_8, kPointBits);
  }
  return out;
}

}  // namespace veneer::planner
