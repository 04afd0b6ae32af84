#include "calib/line_pixels.h"

#include <algorithm>
#include <cmath>

namespace veneer::calib {

PixelLine in_pixels(const FoundLine& line, ScanResolution resolution) {
  const double ax = resolution.to_px(line.from.x).count(), ay = -resolution.to_px(line.from.y).count();
  const double bx = resolution.to_px(line.to.x).count(), by = -resolution.to_px(line.to.y).count();
  const double length = std::hypot(bx - ax, by - ay);
  return {ax, ay, (bx - ax) / length, (by - ay) / length, length};
}

// Calls use(pixel, mm from the line, fraction of its length) for all pixels within reach of the part [begin, end] of
// the line.
void across(const cv::Mat& scan, ScanResolution resolution, const PixelLine& line, double begin, double end,
            double reach_mm, const std::function<void(const cv::Vec3b&, double, double)>& use) {
  const double reach = resolution.to_px(Millimetres(reach_mm)).count();
  const double x0 = line.x + begin * line.length * line.along_x, y0 = line.y + begin * line.length * line.along_y;
  const double x1 = line.x + end * line.length * line.along_x, y1 = line.y + end * line.length * line.along_y;
  const int left = std::max(0, static_cast<int>(std::floor(std::min(x0, x1) - reach - 1)));
  const int right = std::min(scan.cols - 1, static_cast<int>(std::ceil(std::max(x0, x1) + reach + 1)));
  const int top = std::max(0, static_cast<int>(std::floor(std::min(y0, y1) - reach - 1)));
  const int bottom = std::min(scan.rows - 1, static_cast<int>(std::ceil(std::max(y0, y1) + reach + 1)));
  for (int r = top; r <= bottom; ++r) {
    const auto* row = scan.ptr<cv::Vec3b>(r);
    for (int c = left; c <= right; ++c) {
      const double dx = c + 0.5 - line.x, dy = r + 0.5 - line.y;
      const double along = (dx * line.along_x + dy * line.along_y) / line.length;
      if (along < begin || along > end) continue;
      const double off = resolution.to_mm(Pixels(dx * line.along_y - dy * line.along_x)).count();
      if (std::abs(off) < reach_mm) use(row[c], off, along);
    }
  }
}

FoundLine straightened(const FoundLine& line, ScanResolution resolution, std::span<const double> at,
                       std::span<const double> off) {
  double level = 0, slope = 0;
  std::vector<bool> used(at.size(), true);
  for (int round = 0; round < 3; ++round) {
    double n = 0, t = 0, tt = 0, y = 0, ty = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (!used[i]) continue;
      n += 1, t += at[i], tt += at[i] * at[i], y += off[i], ty += at[i] * off[i];
    }
    const double det = n * tt - t * t;
    if (n < 4 || std::abs(det) < 1e-9) break;
    slope = (n * ty - t * y) / det, level = (y - slope * t) / n;
    double sum = 0;
    for (std::size_t i = 0; i < at.size(); ++i) sum += used[i] ? std::pow(off[i] - level - slope * at[i], 2) : 0;
    const double limit = std::max(2.0 * std::sqrt(sum / n), 0.01);
    for (std::size_t i = 0; i < at.size(); ++i) used[i] = std::abs(off[i] - level - slope * at[i]) <= limit;
  }
  const PixelLine px = in_pixels(line, resolution);
  // off is positive to the right of from -> to on the screen turned by y down: the normal is (along_y, -along_x).
  const auto moved = [&](double fraction) {
    const double by = resolution.to_px(Millimetres(level + slope * fraction)).count();
    const double x = px.x + fraction * px.length * px.along_x + by * px.along_y;
    const double y = px.y + fraction * px.length * px.along_y - by * px.along_x;
    return Point<SlitFrame>{resolution.to_mm(Pixels(x)), -resolution.to_mm(Pixels(y))};
  };
  return {line.line, moved(0), moved(1)};
}

double golden_section_minimum(double low, double high, double precision, const std::function<double(double)>& f) {
  constexpr double kRatio = 0.6180339887498949;
  double a = low, b = high, c = b - kRatio * (b - a), d = a + kRatio * (b - a);
  double fc = f(c), fd = f(d);
  while (b - a > precision) {
    if (fc < fd) {
      b = d, d = c, fd = fc, c = b - kRatio * (b - a), fc = f(c);
    } else {
      a = c, c = d, fc = fd, d = a + kRatio * (b - a), fd = f(d);
    }
  }
  return (a + b) / 2;
}

}  // namespace veneer::calib
