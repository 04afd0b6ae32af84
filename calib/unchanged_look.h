// How a sheet would look in a later map if nothing had been done to it: the earlier map in the later one's place, light
// and colour, and by how much a pixel differs from that where nothing was done. Both are learnt from the two maps
// themselves, from what shows what it showed before. Internal; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::calib {

inline constexpr double kSigmaOfMad = 1.4826;  // of a normal distribution, over its median absolute deviation
inline constexpr int kKinds = 36;

struct UnchangedLook {
  cv::Mat expected;  // CV_32FC3, grey levels
  cv::Mat noise;     // CV_32FC3, one sigma of (now - expected)
  cv::Mat kinds;     // CV_8UC1, below kKinds: places that looked alike, as each wood does, have noise of their own
  cv::Mat touched;   // CV_8UC1, 255 where nothing is learnt
  bool light_known = true;  // false: no lamp changes so much, and the earlier map's light is taken for the later one's
};

// Medians over what looked alike and is not touched; of all of it for a kind that is next to nowhere.
cv::Vec<float, kKinds> middles(const cv::Mat& values, const cv::Mat& kinds, const cv::Mat& touched);

// Of two maps of one size, CV_8UC3, that lie on each other to a few tenths of a millimetre. The light may differ by a
// surface of second order and the tone by a curve of second order, a channel each, and by a few hundredths from place
// to place.
UnchangedLook look_unchanged(const cv::Mat& before, const cv::Mat& now, const cv::Mat& touched, double px_per_mm);

}  // namespace veneer::calib
