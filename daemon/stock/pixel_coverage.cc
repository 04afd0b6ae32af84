#include "daemon/stock/pixel_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace veneer::daemon {
namespace {

// What a line from a to b (columns and rows of `out`, y down) adds, when afterwards each pixel is summed up with all to
// its left: the signed area between the line and the right border of the picture, each row on its own.
void add_line(cv::Mat& out, cv::Point2d a, cv::Point2d b) {
  const double sign = b.y > a.y ? 1 : -1;
  if (sign < 0) std::swap(a, b);
  const double slope = b.y > a.y ? (b.x - a.x) / (b.y - a.y) : 0;
  for (int row = static_cast<int>(std::floor(a.y)); row < b.y; ++row) {
    const double top = std::max<double>(row, a.y), bottom = std::min<double>(row + 1, b.y);
    if (bottom <= top) continue;
    double from = a.x + (top - a.y) * slope, to = a.x + (bottom - a.y) * slope;
    if (from > to) std::swap(from, to);
    // Of this row's piece of line, what lies in each column.
    const double per_column = to > from ? (bottom - top) / (to - from) : 0;
    auto* const pixels = out.ptr<double>(row);
    for (int column = static_cast<int>(std::floor(from)); column == static_cast<int>(std::floor(from)) || column < to;
         ++column) {
      const double left = std::max<double>(column, from), right = std::min<double>(column + 1, to);
      const double height = sign * (to > from ? std::max(0.0, right - left) * per_column : bottom - top);
      const double beside = column + 1 - (left + right) / 2;  // of the pixel, to the line's right
      pixels[column] += height * beside;
      pixels[column + 1] += height * (1 - beside);
    }
  }
}

}  // namespace

PixelCoverage pixel_coverage(const Region<PanelFrame>& region, const Raster<PanelFrame>& raster) {
  PixelCoverage out;
  std::vector<std::vector<cv::Point2d>> rings;
  constexpr double kFar = std::numeric_limits<double>::max();
  cv::Point2d low(kFar, kFar), high(-kFar, -kFar);
  for (const auto& ring : region.rings()) {
    auto& pixels = rings.emplace_back();
    for (const auto& p : ring) {
      cv::Point2d& q = pixels.emplace_back();
      raster.to_pixels(p, q.x, q.y);
      low = {std::min(low.x, q.x), std::min(low.y, q.y)};
      high = {std::max(high.x, q.x), std::max(high.y, q.y)};
    }
  }
  if (rings.empty()) return out;
  out.column = static_cast<int>(std::floor(low.x)), out.row = static_cast<int>(std::floor(low.y));
  const int columns = static_cast<int>(std::ceil(high.x)) - out.column;
  const int rows = static_cast<int>(std::ceil(high.y)) - out.row;
  // A line on the right border adds to the column behind it, and one on the border of a pixel to the next.
  cv::Mat sums = cv::Mat::zeros(rows + 1, columns + 2, CV_64FC1);
  const cv::Point2d corner(out.column, out.row);
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      add_line(sums, ring[i] - corner, ring[(i + 1) % ring.size()] - corner);
  // Outer rings are counter-clockwise where y is up, so that they come down on their left side.
  for (int row = 0; row < rows; ++row) {
    auto* const pixels = sums.ptr<double>(row);
    for (int column = 1; column < columns; ++column) pixels[column] += pixels[column - 1];
  }
  out.covered = sums(cv::Rect(0, 0, columns, rows));
  return out;
}

}  // namespace veneer::daemon
