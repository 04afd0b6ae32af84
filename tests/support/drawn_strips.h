// Small work maps drawn by hand for the parts of the veneer mask: a board in one colour, strips with straight sides,
// light, grain and noise. Everything in millimetres from the upper left corner, y down.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

#include "calib/work_map.h"

namespace veneer::drawn {

struct DrawnStrip {
  cv::Point2d upper_left, lower_right;
  cv::Scalar bgr;
  double lean = 0;   // mm by which its lower end lies further right
  double grain = 0;  // relative, in streaks that run down
};

struct DrawnBoard {
  double width = 90, height = 60;
  cv::Scalar bgr{126, 163, 190};
  double texture = 0.01;  // relative
  double falloff = 0;     // of the light, from the middle to a corner
  std::vector<DrawnStrip> strips;
  std::uint64_t seed = 1;
};

constexpr double kPxPerMm = 6;

// Woods of workshops.
inline const cv::Scalar kOak(110, 150, 190), kSilver(149, 150, 150), kEbony(28, 29, 31), kWenge(37, 52, 74),
    kPadauk(38, 66, 164), kWalnut(58, 82, 118), kPine(140, 185, 215);

calib::WorkMap draw(const DrawnBoard& board);
// 255 on the strip.
cv::Mat place_of(const DrawnStrip& strip, const cv::Size& size);
// A disc, a line with round ends, and a knot: in the middle so much of the wood's light is left of each colour, or of
// all of them, and it fades over its outer third.
void put_disc(calib::WorkMap& map, const cv::Point2d& centre, double diameter, const cv::Scalar& bgr);
void put_line(calib::WorkMap& map, const cv::Point2d& from, const cv::Point2d& to, double width, const cv::Scalar& bgr);
void put_knot(calib::WorkMap& map, const cv::Point2d& centre, double wide, double tall, const cv::Scalar& left);
void put_knot(calib::WorkMap& map, const cv::Point2d& centre, double wide, double tall, double left);

}  // namespace veneer::drawn
