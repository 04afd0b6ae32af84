#include "planner/layout/layout_guides.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace veneer::planner {
namespace {

Error refused(const std::string& name, const std::string& why) {
  return {ErrorCode::kInvalidArgument, fmt::format("the sizes of cells of \"{}\" {}", name, why)};
}

}  // namespace

Status check_cell_sizes(const cv::Mat& sizes, const cv::Size& picture, const std::string& name) {
  if (sizes.empty()) return Ok();
  if (sizes.type() != CV_8UC1) return refused(name, "are not an 8-bit grey picture");
  // Of a side as it follows from the other one. A coarse mask has whole cells, along the picture's shorter side too few
  // of them to have its shape.
  const auto alike = [](int cells, double wanted) {
    constexpr double kAlike = 0.02;
    return std::abs(cells - wanted) <= std::max(1.0, kAlike * wanted);
  };
  const double aspect = static_cast<double>(picture.width) / picture.height;
  if (!alike(sizes.rows, sizes.cols / aspect) && !alike(sizes.cols, sizes.rows * aspect))
    return refused(name,
                   fmt::format("have {} x {} pixels, and the picture {} x {}: paint them over the picture, in its "
                               "shape",
                               sizes.cols, sizes.rows, picture.width, picture.height));
  return Ok();
}

Status check_painted_sizes(const cv::Mat& sizes, const cv::Size& picture, const std::string& name) {
  if (sizes.empty()) return Ok();
  if (Status status = check_cell_sizes(sizes, picture, name); !status.ok()) return status;
  double least = 0, most = 0;
  cv::minMaxLoc(sizes, &least, &most);
  if (least < most) return Ok();
  return refused(name,
                 fmt::format("are {} everywhere: paint white where cells are to be small, black where they are to "
                             "be large, or leave them out",
                             most == 0     ? "black"
                             : most == 255 ? "white"
                                           : "of one grey"));
}

}  // namespace veneer::planner
