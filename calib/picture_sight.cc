#include "calib/picture_sight.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace veneer::calib {
namespace {

constexpr int kFieldsAcross = 16;
constexpr double kFinePx = 2, kCoarsePx = 6;  // the pattern is between these
constexpr double kStandsOut = 2.5;            // grey values, rms; noise of 15 comes to 2 there

}  // namespace

double share_in_sight(const cv::Mat& picture) {
  cv::Mat grey, fine, coarse;
  if (picture.channels() == 1)
    grey = picture;
  else
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  cv::GaussianBlur(grey, fine, {}, kFinePx);
  cv::GaussianBlur(fine, coarse, {}, std::sqrt(kCoarsePx * kCoarsePx - kFinePx * kFinePx));
  const int side = std::max(1, picture.cols / kFieldsAcross);
  int fields = 0, in_sight = 0;
  for (int y = 0; y + side <= picture.rows; y += side)
    for (int x = 0; x + side <= picture.cols; x += side) {
      const cv::Rect field(x, y, side, side);
      ++fields;
      if (cv::norm(fine(field), coarse(field)) > kStandsOut * side) ++in_sight;
    }
  return fields == 0 ? 0 : static_cast<double>(in_sight) / fields;
}

}  // namespace veneer::calib
