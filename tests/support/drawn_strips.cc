#include "tests/support/drawn_strips.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::drawn {
namespace {

constexpr int kShift = 8;

// OpenCV's pixel centres are at whole numbers.
cv::Point fixed_point(const cv::Point2d& mm) {
  const auto at = [](double length) {
    return static_cast<int>(std::lround((length * kPxPerMm - 0.5) * (1 << kShift)));
  };
  return {at(mm.x), at(mm.y)};
}

void fill(cv::Mat& picture, const DrawnStrip& strip, const cv::Scalar& colour) {
  const cv::Point2d lean(strip.lean, 0);
  const std::vector<cv::Point> corners = {
      fixed_point(strip.upper_left), fixed_point({strip.lower_right.x, strip.upper_left.y}),
      fixed_point(strip.lower_right + lean), fixed_point(cv::Point2d(strip.upper_left.x, strip.lower_right.y) + lean)};
  cv::fillConvexPoly(picture, corners, colour, cv::LINE_AA, kShift);
}

}  // namespace

calib::WorkMap draw(const DrawnBoard& board) {
  calib::WorkMap map;
  map.px_per_mm = kPxPerMm;
  const cv::Size size(static_cast<int>(std::lround(board.width * kPxPerMm)),
                      static_cast<int>(std::lround(board.height * kPxPerMm)));
  cv::Mat flat(size, CV_8UC3, board.bgr), picture;
  for (const DrawnStrip& strip : board.strips) fill(flat, strip, strip.bgr);
  flat.convertTo(picture, CV_32FC3);

  cv::RNG random(board.seed);
  cv::Mat grit(size, CV_32FC1), streaks(1, size.width, CV_32FC1), noise(size, CV_32FC3);
  random.fill(grit, cv::RNG::NORMAL, 0, board.texture);
  random.fill(streaks, cv::RNG::NORMAL, 0, 1);
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::GaussianBlur(streaks, streaks, {}, 1.0);
  cv::Mat grain = cv::Mat::zeros(size, CV_32FC1);
  for (const DrawnStrip& strip : board.strips) grain.setTo(strip.grain, place_of(strip, size));
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c) {
      const double u = 2.0 * c / size.width - 1, v = 2.0 * r / size.height - 1;
      const double light = 1 - board.falloff * (u * u + v * v) / 2;
      const double relief = 1 + grit.at<float>(r, c) + grain.at<float>(r, c) * streaks.at<float>(0, c);
      picture.at<cv::Vec3f>(r, c) *= static_cast<float>(light * relief);
    }
  picture += noise;
  picture.convertTo(map.bgr, CV_8UC3);
  cv::GaussianBlur(map.bgr, map.bgr, {}, 0.1 * kPxPerMm);
  return map;
}

cv::Mat place_of(const DrawnStrip& strip, const cv::Size& size) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8UC1);
  fill(mask, strip, cv::Scalar(255));
  return mask > 127;
}

void put_disc(calib::WorkMap& map, const cv::Point2d& centre, double diameter, const cv::Scalar& bgr) {
  cv::circle(map.bgr, fixed_point(centre), static_cast<int>(std::lround(diameter / 2 * kPxPerMm * (1 << kShift))), bgr,
             cv::FILLED, cv::LINE_AA, kShift);
}

void put_line(calib::WorkMap& map, const cv::Point2d& from, const cv::Point2d& to, double width,
              const cv::Scalar& bgr) {
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  for (double s = 0; s <= length; s += 0.1) put_disc(map, from + (to - from) * (s / length), width, bgr);
}

void put_knot(calib::WorkMap& map, const cv::Point2d& centre, double wide, double tall, const cv::Scalar& left) {
  for (int r = 0; r < map.bgr.rows; ++r)
    for (int c = 0; c < map.bgr.cols; ++c) {
      const double x = ((c + 0.5) / kPxPerMm - centre.x) / wide, y = ((r + 0.5) / kPxPerMm - centre.y) / tall;
      const double depth = std::clamp((1 - 2 * std::hypot(x, y)) * 3, 0.0, 1.0);
      for (int k = 0; k < 3; ++k) {
        auto& level = map.bgr.at<cv::Vec3b>(r, c)[k];
        level = cv::saturate_cast<std::uint8_t>(level * (1 - depth * (1 - left[k])));
      }
    }
}

void put_knot(calib::WorkMap& map, const cv::Point2d& centre, double wide, double tall, double left) {
  put_knot(map, centre, wide, tall, cv::Scalar::all(left));
}

}  // namespace veneer::drawn
