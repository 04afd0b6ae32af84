#include "planner/matching/patch_pixels.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

// First pixel whose centre is at or beyond `at`.
int first_centre_from(double at) { return static_cast<int>(std::ceil(at - 0.5)); }

}  // namespace

PatchPixels patch_pixels(const Ring<ArtworkFrame>& outline, const PixelGrid& grid, int columns, int rows) {
  std::vector<double> x, y;
  for (const auto& p : outline) {
    x.push_back(grid.resolution.to_px(p.x).count());
    y.push_back(grid.resolution.to_px(grid.height - p.y).count());
  }
  const auto [y_min, y_max] = std::minmax_element(y.begin(), y.end());
  PatchPixels out;
  out.top = std::max(0, first_centre_from(*y_min));
  const int bottom = std::min(rows, first_centre_from(*y_max));
  int left = columns, right = 0;
  for (int row = out.top; row < bottom; ++row) {
    double low = 1e300, high = -1e300;
    const double at = row + 0.5;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t j = (i + 1) % x.size();
      if ((y[i] <= at) == (y[j] <= at)) continue;
      const double cross = x[i] + (x[j] - x[i]) * ((at - y[i]) / (y[j] - y[i]));
      low = std::min(low, cross), high = std::max(high, cross);
    }
    PatchPixels::Span span;
    if (low < high) span = {std::max(0, first_centre_from(low)), std::min(columns, first_centre_from(high))};
    span.end = std::max(span.end, span.begin);
    out.rows.push_back(span);
    out.count += span.end - span.begin;
    if (span.end > span.begin) left = std::min(left, span.begin), right = std::max(right, span.end);
  }
  out.height = static_cast<int>(out.rows.size());
  out.left = std::min(left, right);
  out.width = right - out.left;
  return out;
}

double placement_cost(const cv::Mat& target_features, const PixelGrid& grid, const PatchPixels& pixels,
                      const Raster<PanelFrame>& panel_features,
                      const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork, double limit) {
  const auto channels = static_cast<std::size_t>(target_features.channels());
  const cv::Mat& map = panel_features.pixels;
  const double step = panel_features.resolution.px_per_mm / grid.resolution.px_per_mm;
  const double cos = std::cos(panel_from_artwork.angle().count()) * step;
  const double sin = std::sin(panel_from_artwork.angle().count()) * step;
  double total = 0;
  for (int i = 0; i < pixels.height && total <= limit; ++i) {
    const PatchPixels::Span span = pixels.rows[static_cast<std::size_t>(i)];
    if (span.begin >= span.end) continue;
    const int row = pixels.top + i;
    const Point<ArtworkFrame> start{grid.resolution.to_mm(Pixels(span.begin + 0.5)),
                                    grid.height - grid.resolution.to_mm(Pixels(row + 0.5))};
    double column = 0, down = 0;
    panel_features.to_pixels(panel_from_artwork * start, column, down);
    const auto* target = target_features.ptr<float>(row) + static_cast<std::size_t>(span.begin) * channels;
    double sum = 0;
    for (int k = 0; k < span.end - span.begin; ++k) {
      const double x = std::clamp(column + cos * k - 0.5, 0.0, map.cols - 1.0);
      const double y = std::clamp(down - sin * k - 0.5, 0.0, map.rows - 1.0);
      const int c = std::min(static_cast<int>(x), std::max(map.cols - 2, 0));
      const int r = std::min(static_cast<int>(y), std::max(map.rows - 2, 0));
      const double fx = x - c, fy = y - r;
      const std::size_t right = map.cols > 1 ? channels : 0;
      const auto* upper = map.ptr<float>(r) + static_cast<std::size_t>(c) * channels;
      const auto* lower = map.ptr<float>(std::min(r + 1, map.rows - 1)) + static_cast<std::size_t>(c) * channels;
      for (std::size_t ch = 0; ch < channels; ++ch) {
        const double above = upper[ch] + fx * (upper[ch + right] - upper[ch]);
        const double below = lower[ch] + fx * (lower[ch + right] - lower[ch]);
        const double d = above + fy * (below - above) - target[static_cast<std::size_t>(k) * channels + ch];
        sum += d * d;
      }
    }
    total += sum;
  }
  return total;
}

}  // namespace veneer::planner
