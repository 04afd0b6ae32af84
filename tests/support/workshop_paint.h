// What boards, woods and what is put on them are painted with.
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace veneer::workshop {

inline constexpr double kFiner = 2;  // the sheet is painted this much finer than it is scanned

inline cv::Vec3f rgb(double r, double g, double b) {
  return {static_cast<float>(b), static_cast<float>(g), static_cast<float>(r)};
}

// Noise, smooth over so many pixels along each axis; standard deviation 1.
inline cv::Mat soft_noise(cv::Size size, double along_x, double along_y, cv::RNG& random) {
  const cv::Size coarse(std::max(4, static_cast<int>(size.width / along_x) + 2),
                        std::max(4, static_cast<int>(size.height / along_y) + 2));
  cv::Mat noise(coarse, CV_32FC1), out;
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::resize(noise, out, size, 0, 0, cv::INTER_CUBIC);
  return out;
}

}  // namespace veneer::workshop
