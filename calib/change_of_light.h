// How a later map's light and tones differ from an earlier one's, learnt once over a whole sheet. Internal;
// thread-safe.
#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace veneer::calib {

struct ChangeOfLight {
  // A channel each (b, g, r): gain, its surface of second order (x, y, xx, xy, yy, of the sheet from -1 to 1), black
  // level in grey levels, and what bends the tone curve.
  using Terms = cv::Vec<double, 8>;
  std::array<Terms, 3> channels;
  cv::Size sheet;  // pixels of both maps
  // False: next to nothing was left to learn from, or no lamp changes so much. All stays as it is then.
  bool known = true;
};

// Of two maps of one size, CV_8UC3, that lie on each other to a few tenths of a millimetre; nothing is learnt where
// `touched`, CV_8UC1, is not 0. Of places that do not lie all over the sheet a gain is learnt and nothing that would
// have to be extrapolated; of a sheet of a single tone nothing that depends on the tone.
ChangeOfLight learn_change_of_light(const cv::Mat& before, const cv::Mat& now, const cv::Mat& touched,
                                    double px_per_mm);

// The part of the earlier map that begins at pixel `at` of the sheet, as the later light shows it; both CV_32FC3.
cv::Mat in_later_light(const ChangeOfLight& light, const cv::Mat& before, const cv::Point& at);

}  // namespace veneer::calib
