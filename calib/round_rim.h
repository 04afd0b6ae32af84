// The rim of something round in a strip of wood: whether there is one all around, and the circle it lies on. A screw's
// head, a hole and a countersink end at one; a knot fades into its wood, and the eyes of a figure are no circles.
// Internal to veneer_mask. Thread-safe.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "calib/board_model.h"

namespace veneer::calib {

struct ScrewSpot {
  cv::Point2d centre;  // px of the view, centres at +0.5
  double diameter = 0;
};

// How much the planes change over the width of a rim anywhere on a strip: what a rim is measured by.
class RimScale {
 public:
  // `strip` is 255 on the strip, `box` bounds it.
  RimScale(const BoardView& view, const cv::Mat& strip, const cv::Rect& box);
  const std::array<double, 3>& usual() const { return usual_; }

 private:
  std::array<double, 3> usual_{};  // logarithms
};

struct RoundRim {
  ScrewSpot circle;
  double step = 0;    // that all but a few of the sides show, in what is usual on the strip; 0 = there is no rim
  bool dark = false;  // darker within than the wood around it, and clearly darkest in its middle
  bool soft = false;  // it fades over much of a millimetre, as knots do; a rim is as sharp as the optics
  bool nothing_seen = false;  // most of its middle is the scanner's black
};

// What is darkest in its middle is so by this much: less is noise.
constexpr double kClearlyDarker = 0.05;  // logarithm

// The outermost clear rim about `spot`, its centre up to half of its size away.
RoundRim find_rim(const BoardView& view, const RimScale& scale, const ScrewSpot& spot);

// A hue below this is none to tell anything by.
constexpr double kHasHue = 0.15;  // logarithm, length of both opponent colours
// Whether a circle lies in dark wood, is darker than that, and has less of a hue than the wood would have if it were as
// dark: a hole's dark is grey, a knot's is the wood's own. `strip` is 255 on the wood; never where half of what lies
// around the circle is no wood.
bool is_grey_in_dark_wood(const BoardView& view, const cv::Mat& strip, const ScrewSpot& circle);

}  // namespace veneer::calib
