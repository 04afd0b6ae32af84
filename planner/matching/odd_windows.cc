#include "planner/matching/odd_windows.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

// Blocks in a window, by area: what most have, and the most for which scores fit 32 bits (largest_score_entry()).
constexpr double kUsualBlocks = 25, kMostOddBlocks = 36;
constexpr double kWidestScale = 3;  // the largest window of a scale, by area, against its smallest

}  // namespace

OddWindows::OddWindows(const std::vector<WindowClass>& classes) {
  for (const WindowClass& it : classes) {
    if (it.filled) continue;
    if (windows_.filled) {
      windows_ = it;
      continue;
    }
    windows_.width = std::min(windows_.width, it.width), windows_.height = std::min(windows_.height, it.height);
    windows_.widest = std::max(windows_.widest, it.widest), windows_.tallest = std::max(windows_.tallest, it.tallest);
    windows_.least = std::min(windows_.least, it.least), windows_.most = std::max(windows_.most, it.most);
  }
  if (windows_.filled) return;
  least_ = static_cast<double>(windows_.least);
  const double times = static_cast<double>(windows_.most) / least_;
  const int scales = std::max(1, static_cast<int>(std::ceil(std::log(times) / std::log(kWidestScale) - 1e-9)));
  step_ = std::pow(times, 1.0 / scales);
  for (int scale = 0; scale < scales; ++scale) {
    const double smallest = least_ * std::pow(step_, scale);
    const double block = std::max(smallest * std::sqrt(step_) / kUsualBlocks, smallest * step_ / kMostOddBlocks);
    sides_.push_back(std::max(1.0, std::sqrt(block) / 2));
  }
}

std::size_t OddWindows::scale_of(const PatchPixels& pixels) const {
  if (scales() == 1) return 0;
  const double area = static_cast<double>(pixels.width) * pixels.height;
  const double scale = std::floor(std::log(area / least_) / std::log(step_));
  return static_cast<std::size_t>(std::clamp(scale, 0.0, static_cast<double>(scales() - 1)));
}

CellGrid OddWindows::grid(std::size_t scale) const {
  return cells_over(cells_of(sides_[scale], sides_[scale]), windows_.widest, windows_.tallest);
}

CellGrid cells_over(const CellGrid& scale, int width, int height) {
  CellGrid out = scale;
  out.columns = 2 * static_cast<int>(std::ceil(width / (2 * scale.width) - 1e-9));
  out.rows = 2 * static_cast<int>(std::ceil(height / (2 * scale.height) - 1e-9));
  return out;
}

}  // namespace veneer::planner
