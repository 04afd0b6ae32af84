#include "calib/tag_sharpness.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr double kSampledEvery = 0.25;  // px across a rim

// Half the way from where the levels leave black to where they reach white, px: the deviation of a Gaussian blur;
// nothing where that is no step from black to white.
std::optional<double> half_width(const std::vector<double>& levels) {
  constexpr double kLow = 0.16, kHigh = 0.84;  // of the step: two standard deviations of a Gaussian apart
  constexpr double kClearStep = 40;            // grey levels
  // The outermost tenths show black and white alone.
  const std::size_t flat = std::max<std::size_t>(1, levels.size() / 10);
  double black = 0, white = 0;
  for (std::size_t i = 0; i < flat; ++i) black += levels[i], white += levels[levels.size() - 1 - i];
  black /= static_cast<double>(flat), white /= static_cast<double>(flat);
  if (white - black < kClearStep) return std::nullopt;
  const auto at = [&](std::size_t i) { return (levels[i] - black) / (white - black); };
  // From the middle outwards, so that noise of the flat ends does not count.
  std::size_t middle = 1;
  while (middle + 1 < levels.size() && at(middle) < 0.5) ++middle;
  std::size_t low = middle - 1, high = middle;
  while (low > 0 && at(low) > kLow) --low;
  while (high + 1 < levels.size() && at(high) < kHigh) ++high;
  if (at(low) > kLow || at(high) < kHigh) return std::nullopt;
  const double from = static_cast<double>(low) + (kLow - at(low)) / (at(low + 1) - at(low)),
               to = static_cast<double>(high) - (at(high) - kHigh) / (at(high) - at(high - 1));
  return 0.5 * (to - from) * kSampledEvery;
}

// Of one side, from a corner to the next; corners run counter-clockwise on the screen, where y is down.
std::optional<double> blur_of_side(const cv::Mat& grey, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr double kCells = 8;    // of a tag's black square, along a side
  constexpr double kReach = 0.5;  // cells to both sides of a rim that show its black and its white
  constexpr std::size_t kFewest = 8;
  const double length = (to - from).norm();
  const Eigen::Vector2d along = (to - from) / length, outwards(-along.y(), along.x());
  const double reach = kReach * length / kCells;
  const int places = std::clamp(static_cast<int>(length), 8, 100), half = static_cast<int>(reach / kSampledEvery);
  std::vector<double> widths;
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector2d middle = from + along * (length * (0.08 + 0.84 * (i + 0.5) / places));
    std::vector<double> levels;
    levels.reserve(static_cast<std::size_t>(2 * half + 1));
    for (int k = -half; k <= half; ++k) {
      const Eigen::Vector2d at = middle + outwards * (k * kSampledEvery);
      levels.push_back(level_at(grey, at.x(), at.y()));
    }
    if (const auto width = half_width(levels)) widths.push_back(*width);
  }
  if (widths.size() < kFewest || 2 * widths.size() < static_cast<std::size_t>(places)) return std::nullopt;
  return median(std::move(widths));
}

std::optional<double> sharper_of(const std::optional<double>& a, const std::optional<double>& b) {
  if (a && b) return std::min(*a, *b);
  return a ? a : b;
}

}  // namespace

std::vector<TagSharpness> measure_sharpness(const cv::Mat& picture, const std::vector<Tag<ScanFrame>>& tags,
                                            ScanResolution resolution) {
  std::vector<TagSharpness> out;
  if (picture.empty() || picture.depth() != CV_8U) return out;
  cv::Mat grey = picture;
  if (picture.channels() == 3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  for (const Tag<ScanFrame>& tag : tags) {
    std::array<std::optional<double>, 4> sides;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto &from = tag.corners.at(i), &to = tag.corners.at((i + 1) % 4);
      sides.at(i) = blur_of_side(grey, Eigen::Vector2d(from.x.count(), from.y.count()),
                                 Eigen::Vector2d(to.x.count(), to.y.count()));
    }
    const auto one = sharper_of(sides[0], sides[2]), other = sharper_of(sides[1], sides[3]);
    if (!one && !other) continue;
    out.push_back({tag.id, resolution.to_mm(Pixels(std::max(one.value_or(0), other.value_or(0))))});
  }
  return out;
}

}  // namespace veneer::calib
