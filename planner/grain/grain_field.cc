#include "planner/grain/grain_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

constexpr double kWoodReach = 2;               // mm, of the sum over wood
constexpr float kFaintest = 1e-4F;             // change of tone per pixel, squared: less is noise
constexpr double kCalm = 0.08;                 // change of tone within a patch: half as sure as where there is none
constexpr std::array kReaches{0.7, 2.0, 6.0};  // patches over which a picture's edges are summed
constexpr std::array kReachWeights{1.0, 0.3, 0.05};

// Of the tone's change: (xx - yy, 2 xy, xx + yy), a pixel a millimetre.
cv::Mat tensor_of(const cv::Mat& grey, ScanResolution resolution) {
  cv::Mat dx, dy, out;
  cv::Sobel(grey, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(grey, dy, CV_32F, 0, 1, 3, 0.125);
  const cv::Mat xx = dx.mul(dx), yy = dy.mul(dy);
  const std::array<cv::Mat, 3> parts{xx - yy, 2 * dx.mul(dy), xx + yy};
  cv::merge(parts.data(), parts.size(), out);
  const auto side = [&](int pixels) {
    return std::max(1, static_cast<int>(std::lround(resolution.to_mm(Pixels(pixels)).count())));
  };
  cv::resize(out, out, {side(grey.cols), side(grey.rows)}, 0, 0, cv::INTER_AREA);
  return out;
}

// Across the change of tone.
cv::Vec2f along(const cv::Vec3f& tensor) {
  const float length = std::max(tensor[2], 1e-12F);
  return {-tensor[0] / length, -tensor[1] / length};
}

}  // namespace

cv::Mat grain_of_wood(const cv::Mat& grey, ScanResolution resolution) {
  cv::Mat tensor = tensor_of(grey, resolution);
  cv::GaussianBlur(tensor, tensor, {}, kWoodReach, 0, cv::BORDER_REPLICATE);
  cv::Mat out(tensor.size(), CV_32FC2);
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c) {
      const auto& t = tensor.at<cv::Vec3f>(r, c);
      out.at<cv::Vec2f>(r, c) = along(t) * (t[2] / (t[2] + kFaintest));
    }
  return out;
}

cv::Mat grain_of_picture(const cv::Mat& grey, ScanResolution resolution, Millimetres patch) {
  cv::Mat smooth;
  cv::GaussianBlur(grey, smooth, {}, std::max(0.5, resolution.to_px(patch / 4).count()), 0, cv::BORDER_REPLICATE);
  const cv::Mat tensor = tensor_of(smooth, resolution);
  cv::Mat sum(tensor.size(), CV_32FC3, cv::Scalar::all(0)), near;
  for (std::size_t i = 0; i < kReaches.size(); ++i) {
    cv::Mat wide;
    cv::GaussianBlur(tensor, wide, {}, std::max(0.5, kReaches[i] * patch.count()), 0, cv::BORDER_REPLICATE);
    if (i == 0) near = wide;
    sum += kReachWeights[i] * wide;
  }
  // How much the tone changes within a patch.
  const double px_per_patch = resolution.to_px(patch).count();
  cv::Mat out(sum.size(), CV_32FC2);
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c) {
      const double change = std::sqrt(std::max(0.0F, near.at<cv::Vec3f>(r, c)[2])) * px_per_patch;
      const cv::Vec2f direction = along(sum.at<cv::Vec3f>(r, c));
      const auto sure = static_cast<float>(1 / (1 + (change / kCalm) * (change / kCalm)));
      const auto length = static_cast<float>(cv::norm(direction));
      if (length > 1e-6F)
        out.at<cv::Vec2f>(r, c) = direction * (sure / length);
      else
        out.at<cv::Vec2f>(r, c) = {0, 0};
    }
  return out;
}

cv::Vec2f direction_at(const cv::Mat& field, double x_mm, double y_mm) {
  const double x = std::clamp(x_mm - 0.5, 0.0, field.cols - 1.0), y = std::clamp(y_mm - 0.5, 0.0, field.rows - 1.0);
  const int c = static_cast<int>(x), r = static_cast<int>(y);
  const int right = std::min(c + 1, field.cols - 1), below = std::min(r + 1, field.rows - 1);
  const auto fx = static_cast<float>(x - c), fy = static_cast<float>(y - r);
  const auto at = [&](int row, int column) { return field.at<cv::Vec2f>(row, column); };
  return (1 - fy) * ((1 - fx) * at(r, c) + fx * at(r, right)) + fy * ((1 - fx) * at(below, c) + fx * at(below, right));
}

}  // namespace veneer::planner
