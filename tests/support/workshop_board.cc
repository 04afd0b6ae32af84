#include "tests/support/workshop_board.h"

#include "tests/support/workshop_paint.h"

namespace veneer::workshop {

cv::Mat paint_board(int board, cv::Size size, double px, cv::RNG& random, std::string& name) {
  const auto painted = [&](const cv::Vec3f& colour, double grit, double slow) {
    const cv::Vec3f tone = colour * static_cast<float>(random.uniform(0.95, 1.05));
    const cv::Mat fine = soft_noise(size, 0.3 * px, 0.3 * px, random),
                  wide = soft_noise(size, 30 * px, 30 * px, random);
    cv::Mat out(size, CV_32FC3);
    for (int r = 0; r < size.height; ++r)
      for (int c = 0; c < size.width; ++c)
        out.at<cv::Vec3f>(r, c) =
            tone * static_cast<float>(1 + grit * fine.at<float>(r, c) + slow * wide.at<float>(r, c));
    return out;
  };
  const auto fibres = [&](cv::Mat& out, double contrast, double across, double along, bool upright) {
    const cv::Mat streaks =
        upright ? soft_noise(size, across * px, along * px, random) : soft_noise(size, along * px, across * px, random);
    for (int r = 0; r < size.height; ++r)
      for (int c = 0; c < size.width; ++c)
        out.at<cv::Vec3f>(r, c) *= static_cast<float>(1 + contrast * streaks.at<float>(r, c));
  };
  cv::Mat out;
  switch (board) {
    case 0:
      name = "beige MDF";
      out = painted(rgb(190, 163, 126), 0.030, 0.01);
      return out;
    case 1:
      name = "birch plywood";
      out = painted(rgb(224, 202, 164), 0.008, 0.015);
      {
        const bool upright = random.uniform(0, 2) == 1;
        fibres(out, 0.030, 0.35, 7, upright);
        fibres(out, 0.020, 3, 50, upright);
      }
      return out;
    case 2:
      name = "white";
      return painted(rgb(240, 240, 238), 0.003, 0.003);
    case 3:
      name = "off-white";
      return painted(rgb(228, 222, 208), 0.006, 0.006);
    case 4:
      name = "grey";
      return painted(rgb(128, 129, 131), 0.02, 0.012);
    case 5:
      name = "black";
      return painted(rgb(31, 31, 33), 0.06, 0.02);
    case 6:
      name = "dark hardboard";
      out = painted(rgb(96, 68, 46), 0.05, 0.02);
      fibres(out, 0.06, 0.25, 1.2, random.uniform(0, 2) == 1);
      return out;
    default:
      name = "light grey primer";
      return painted(rgb(186, 188, 189), 0.012, 0.01);
  }
}

}  // namespace veneer::workshop
