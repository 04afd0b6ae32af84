#include "planner/drawings/drawn_areas.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "planner/drawings/drawing.h"
#include "planner/layout/label_regions.h"
#include "planner/pictures/pictures.h"

namespace veneer::planner {
namespace {

constexpr double kDrawnSide = 2000;     // pixels of the longer side
constexpr int kPointBits = 4;           // bits behind the point of drawn coordinates
constexpr double kFarthestPixel = 1e7;  // of partings, which may reach beyond the regions

// XML, after the mark of its encoding and blanks: no picture begins so.
bool is_drawing(std::string_view bytes) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
  const std::size_t at = bytes.find_first_not_of(" \t\r\n");
  return at != std::string_view::npos && bytes[at] == '<';
}

struct Ends {
  DrawingPoint from{}, to{};
};

// The ends of a line that goes straight ahead, and perhaps back, to within so many mm: it has no inside, whoever closes
// it.
std::optional<Ends> straight(const DrawnLine& line, double within) {
  const auto farthest = [&](const DrawingPoint& from) {
    return *std::ranges::max_element(line.points, {},
                                     [&](const DrawingPoint& p) { return std::hypot(p[0] - from[0], p[1] - from[1]); });
  };
  const DrawingPoint a = farthest(line.points.front()), b = farthest(a);
  const double x = b[0] - a[0], y = b[1] - a[1], length = std::hypot(x, y);
  const bool beside = std::ranges::any_of(line.points, [&](const DrawingPoint& p) {
    return std::abs((p[0] - a[0]) * y - (p[1] - a[1]) * x) > within * length;
  });
  if (beside || !std::isfinite(length)) return std::nullopt;
  return Ends{a, b};
}

// What counts as none, in mm: of a drawing as large as wood, as a person sees it; of a smaller one, which is meant to
// be stretched, a share of its own size.
struct Tolerances {
  double straight = 2 * kFlatMm;  // aside of a straight line
  double closed = 0.1;            // between the ends of a line that is closed, and from a parting's end to a border
};
Tolerances tolerances_of(const Drawing& drawing) {
  Drawing wide;  // which lines are partings is known only with the tolerance
  std::ranges::copy_if(drawing.lines, std::back_inserter(wide.lines), [](const auto& l) { return !straight(l, 0); });
  const DrawingExtent e = extent_of(wide);
  const double side = std::max(e.max_x - e.min_x, e.max_y - e.min_y);
  Tolerances out;
  if (wide.lines.empty() || !std::isfinite(side)) return out;
  out.straight = std::min(out.straight, side / kDrawnSide / 2);  // half a pixel
  out.closed = std::min(out.closed, side / 100);
  return out;
}

// Whether its inside is a region: a viewer closes what is filled.
bool encloses(const DrawnLine& line, const Tolerances& tolerances) {
  if (line.filled) return true;
  const DrawingPoint &a = line.points.front(), &b = line.points.back();
  return std::hypot(a[0] - b[0], a[1] - b[1]) <= tolerances.closed;
}

// kInvalidArgument: there is no region, or a line encloses none.
Status all_closed(const Drawing& drawing, const Tolerances& tolerances) {
  const auto closed = [&](const DrawnLine& line) { return encloses(line, tolerances); };
  if (std::ranges::none_of(drawing.lines, closed))
    return Error{ErrorCode::kInvalidArgument,
                 "the drawing has no closed region: close the paths whose insides are pieces"};
  const auto open = std::ranges::find_if_not(drawing.lines, closed);
  if (open == drawing.lines.end()) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("the line of the drawing that begins at {:.2f}, {:.2f} mm encloses nothing: close it or "
                           "fill it, so that its inside is a piece, or take it out",
                           open->points.front()[0], open->points.front()[1])};
}

// Regions as they lie over each other, and the partings over them: straight lines that part what they cross.
class AreaRaster {
 public:
  AreaRaster(const DrawingExtent& extent, double scale)
      : extent_(extent),
        scale_(scale),
        labels_(cvRound((extent.max_y - extent.min_y) * scale), cvRound((extent.max_x - extent.min_x) * scale),
                CV_32SC1, cv::Scalar::all(0)),
        partings_(labels_.size(), CV_8UC1, cv::Scalar::all(0)) {}

  // A region, closed or not. What is not filled lets the partings under it be seen.
  void fill(const DrawnLine& line) {
    std::vector<std::vector<cv::Point>> rings(1);
    for (const DrawingPoint& p : line.points) rings[0].push_back(pixel(p));
    cv::fillPoly(labels_, rings, cv::Scalar::all(++regions_), cv::LINE_8, kPointBits);
    if (line.filled) cv::fillPoly(partings_, rings, cv::Scalar::all(0), cv::LINE_8, kPointBits);
  }

  // A parting ends where what it parts does, to within so many mm.
  void part(const Ends& ends, double within) {
    const double x = ends.to[0] - ends.from[0], y = ends.to[1] - ends.from[1], length = std::hypot(x, y);
    const double farther = (within + 1 / scale_) / length;
    const DrawingPoint from{ends.from[0] - x * farther, ends.from[1] - y * farther},
        to{ends.to[0] + x * farther, ends.to[1] + y * farther};
    cv::line(partings_, pixel(from), pixel(to), cv::Scalar::all(255), 1, cv::LINE_8, kPointBits);
    has_partings_ = true;
  }

  // CV_8UC3, one for each area.
  cv::Mat colours() {
    if (has_partings_) part_regions(labels_, partings_);
    cv::Mat out(labels_.size(), CV_8UC3);
    for (int r = 0; r < out.rows; ++r)
      for (int c = 0; c < out.cols; ++c) {
        const auto label = static_cast<std::uint32_t>(labels_.at<int>(r, c));
        out.at<cv::Vec3b>(r, c) = {static_cast<std::uint8_t>(label), static_cast<std::uint8_t>(label >> 8U),
                                   static_cast<std::uint8_t>(label >> 16U)};
      }
    return out;
  }

 private:
  // Pixel centres lie at whole numbers to OpenCV.
  cv::Point pixel(const DrawingPoint& p) const {
    const auto fixed = [](double at) { return cvRound((at - 0.5) * (1 << kPointBits)); };
    return {fixed((p[0] - extent_.min_x) * scale_), fixed((extent_.max_y - p[1]) * scale_)};
  }

  DrawingExtent extent_;
  double scale_;
  cv::Mat labels_, partings_;
  int regions_ = 0;
  bool has_partings_ = false;
};

}  // namespace

Result<cv::Mat> areas_of_file(std::string_view bytes, const std::string& name) {
  if (!is_drawing(bytes)) return decode_labels(bytes, name);
  Result<cv::Mat> areas = areas_of_svg(std::string(bytes));
  if (!areas.ok()) return Error{areas.error().code, fmt::format("{}: {}", name, areas.error().message)};
  return areas;
}

std::string_view ending_of(std::string_view bytes) {
  if (is_drawing(bytes)) return ".svg";
  if (bytes.starts_with("\x89PNG")) return ".png";
  return bytes.starts_with("\xff\xd8\xff") ? ".jpg" : "";
}

Result<cv::Mat> areas_of_svg(const std::string& text) {
  Result<Drawing> drawing = read_svg(text);
  if (!drawing.ok()) return drawing.error();
  const Tolerances tolerances = tolerances_of(*drawing);
  Drawing regions;  // and what should be
  std::ranges::copy_if(drawing->lines, std::back_inserter(regions.lines),
                       [&](const auto& l) { return !straight(l, tolerances.straight); });
  if (const Status closed = all_closed(regions, tolerances); !closed.ok()) return closed.error();
  const DrawingExtent extent = extent_of(regions);
  const double width = extent.max_x - extent.min_x, height = extent.max_y - extent.min_y;
  if (!is_finite(*drawing) || !std::isfinite(width + height))
    return Error{ErrorCode::kInvalidArgument, "the drawing is larger than can be measured: draw it again, smaller"};
  const double scale = kDrawnSide / std::max(width, height);
  const DrawingExtent all = extent_of(*drawing);
  if ((std::max(all.max_x - all.min_x, all.max_y - all.min_y)) * scale > kFarthestPixel)
    return Error{ErrorCode::kInvalidArgument,
                 "a line of the drawing reaches far beyond its regions: shorten it, or take it out"};
  if (!(std::min(width, height) * scale >= 2))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the drawing is only {:.2f} x {:.2f} mm large: draw regions, not lines", width, height)};
  AreaRaster raster(extent, scale);
  for (const DrawnLine& line : drawing->lines) {
    const auto ends = straight(line, tolerances.straight);
    if (!ends)
      raster.fill(line);
    else if (!line.colour.empty())
      raster.part(*ends, tolerances.closed);
  }
  return raster.colours();
}

}  // namespace veneer::planner
