#include "daemon/services/inscribed.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::daemon {

std::optional<InscribedSquare> largest_square(const Raster<PanelFrame>& free) {
  // Of the square whose lower right pixel is this one: one more than the smallest of those that end beside it.
  std::vector<int> above(static_cast<std::size_t>(free.pixels.cols) + 1, 0), here = above;
  int side = 0, right = 0, lower = 0;
  for (int row = 0; row < free.pixels.rows; ++row) {
    const auto* const pixels = free.pixels.ptr<unsigned char>(row);
    for (int column = 0; column < free.pixels.cols; ++column) {
      const auto at = static_cast<std::size_t>(column) + 1;
      here[at] = pixels[column] == 0 ? 0 : 1 + std::min({above[at], above[at - 1], here[at - 1]});
      if (here[at] > side) side = here[at], right = column + 1, lower = row + 1;
    }
    std::swap(above, here);
  }
  if (side == 0) return std::nullopt;
  return InscribedSquare{free.from_pixels(right - side, lower), free.resolution.to_mm(Pixels(side))};
}

std::optional<InscribedCircle> largest_circle(const Raster<PanelFrame>& free) {
  // A lattice of half pixels: what is nearest to one of its points on a square pixel is one of them too, so that the
  // distance between points is the distance to the pixel.
  cv::Mat lattice(2 * free.pixels.rows + 1, 2 * free.pixels.cols + 1, CV_8UC1, cv::Scalar(255));
  for (int row = 0; row < free.pixels.rows; ++row) {
    const auto* const pixels = free.pixels.ptr<unsigned char>(row);
    auto* const middles = lattice.ptr<unsigned char>(2 * row + 1);
    for (int column = 0; column < free.pixels.cols; ++column)
      if (pixels[column] == 0) middles[2 * column + 1] = 0;
  }
  cv::erode(lattice, lattice, {});  // from the middle of such a pixel to its sides
  cv::rectangle(lattice, {0, 0, lattice.cols, lattice.rows}, cv::Scalar(0), 1);
  cv::Mat distance;
  cv::distanceTransform(lattice, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE, CV_32F);
  double most = 0;
  cv::Point at;
  cv::minMaxLoc(distance, nullptr, &most, nullptr, &at);
  if (most <= 0) return std::nullopt;
  return InscribedCircle{free.from_pixels(at.x / 2.0, at.y / 2.0), free.resolution.to_mm(Pixels(most / 2))};
}

Raster<PanelFrame> in_larger_pixels(const Raster<PanelFrame>& free, int factor) {
  if (factor <= 1) return free;
  // The raster's origin is its lower left corner: what is left over is added above and on the right.
  const int columns = (free.pixels.cols + factor - 1) / factor, rows = (free.pixels.rows + factor - 1) / factor;
  cv::Mat whole;
  cv::copyMakeBorder(free.pixels, whole, rows * factor - free.pixels.rows, 0, 0, columns * factor - free.pixels.cols,
                     cv::BORDER_CONSTANT, cv::Scalar(0));
  Raster<PanelFrame> out{cv::Mat(rows, columns, CV_8UC1), ScanResolution{free.resolution.px_per_mm / factor},
                         free.origin};
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {factor, factor});
  cv::erode(whole != 0, whole, square, {0, 0}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      out.pixels.at<unsigned char>(row, column) = whole.at<unsigned char>(row * factor, column * factor);
  return out;
}

Raster<PanelFrame> covered_by_squares(const Raster<PanelFrame>& free, Millimetres side,
                                      const std::function<void(cv::Mat& corners, int side_px)>& accepts) {
  // A whole number of pixels stays one although millimetres were in between.
  const int pixels = std::max(1, static_cast<int>(std::ceil(free.resolution.to_px(side).count() - 1e-6)));
  Raster<PanelFrame> out{cv::Mat::zeros(free.pixels.size(), CV_8UC1), free.resolution, free.origin};
  if (pixels > free.pixels.cols || pixels > free.pixels.rows) return out;
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {pixels, pixels});
  cv::Mat corners;
  cv::erode(free.pixels != 0, corners, square, {0, 0}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  if (accepts) accepts(corners, pixels);
  cv::dilate(corners, out.pixels, square, {pixels - 1, pixels - 1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  return out;
}

}  // namespace veneer::daemon
