// How a sheet would look in a later map if nothing had been done to it: the earlier map in the later one's place, light
// and colour, and by how much a pixel differs from that where nothing was done. Both are learnt from the two maps
// themselves, from what shows what it showed before. Internal; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

#include "calib/change_of_light.h"

namespace veneer::calib {

inline constexpr double kSigmaOfMad = 1.4826;  // of a normal distribution, over its median absolute deviation
inline constexpr int kKinds = 36;

struct UnchangedLook {
  cv::Mat expected;  // CV_32FC3, grey levels
  cv::Mat noise;     // CV_32FC3, one sigma of (now - expected)
  cv::Mat kinds;     // CV_8UC1, below kKinds: places that looked alike, as each wood does, have noise of their own
  cv::Mat touched;   // CV_8UC1, 255 where nothing is learnt
};

// Medians over what looked alike and is not touched; of all of it for a kind that is next to nowhere.
cv::Vec<float, kKinds> middles(const cv::Mat& values, const cv::Mat& kinds, const cv::Mat& touched);

// Of two maps of one size, CV_8UC3, that lie on each other to a few tenths of a millimetre: the part of a sheet that
// begins at pixel `at` of it. Beside the whole sheet's `light` it may differ by a few hundredths from place to place.
UnchangedLook look_unchanged(const cv::Mat& before, const cv::Mat& now, const cv::Mat& touched, double px_per_mm,
                             const ChangeOfLight& light, const cv::Point& at);

}  // namespace veneer::calib
