#include "calib/exposure.h"

#include <opencv2/core.hpp>

namespace veneer::calib {

Exposure measure_exposure(const cv::Mat& map, const cv::Mat& usable) {
  // Compression and noise leave an end by a level or two.
  constexpr int kUpperEnd = 254, kLowerEnd = 2;
  const int wood = cv::countNonZero(usable);
  if (wood == 0) return {};
  cv::Mat inside, sunk;
  cv::inRange(map, cv::Scalar::all(0), cv::Scalar::all(kUpperEnd - 1), inside);
  cv::inRange(map, cv::Scalar::all(0), cv::Scalar::all(kLowerEnd), sunk);
  return {static_cast<double>(cv::countNonZero(~inside & (usable != 0))) / wood,
          static_cast<double>(cv::countNonZero(sunk & (usable != 0))) / wood};
}

}  // namespace veneer::calib
