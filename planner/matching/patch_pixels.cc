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
  const auto [x_min, x_max] = std::minmax_element(x.begin(), x.end());
  const auto [y_min, y_max] = std::minmax_element(y.begin(), y.end());
  PatchPixels out;
  out.left = std::clamp(first_centre_from(*x_min), 0, columns);
  out.top = std::clamp(first_centre_from(*y_min), 0, rows);
  out.width = std::clamp(first_centre_from(*x_max), out.left, columns) - out.left;
  out.height = std::clamp(first_centre_from(*y_max), out.top, rows) - out.top;
  std::vector<double> crossings;
  for (int row = out.top; row < out.top + out.height; ++row) {
    // Going along the centres, each crossed side leads into the outline or out of it.
    const double at = row + 0.5;
    crossings.clear();
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t j = (i + 1) % x.size();
      if ((y[i] <= at) == (y[j] <= at)) continue;
      // Always from the same end: neighbours share a side in opposite directions.
      const std::size_t from = y[i] < y[j] ? i : j, to = y[i] < y[j] ? j : i;
      crossings.push_back(x[from] + (x[to] - x[from]) * ((at - y[from]) / (y[to] - y[from])));
    }
    std::sort(crossings.begin(), crossings.end());
    bool joins = false;
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const PatchPixels::Span span{row, std::clamp(first_centre_from(crossings[i]), out.left, out.left + out.width),
                                   std::clamp(first_centre_from(crossings[i + 1]), out.left, out.left + out.width)};
      if (span.begin >= span.end) continue;
      out.count += span.length();
      if (joins && out.spans.back().end == span.begin)
        out.spans.back().end = span.end;
      else
        out.spans.push_back(span);
      joins = true;
    }
  }
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
  for (const PatchPixels::Span& span : pixels.spans) {
    if (total > limit) break;
    const Point<ArtworkFrame> start{grid.resolution.to_mm(Pixels(span.begin + 0.5)),
                                    grid.height - grid.resolution.to_mm(Pixels(span.row + 0.5))};
    double column = 0, down = 0;
    panel_features.to_pixels(panel_from_artwork * start, column, down);
    const auto* target = target_features.ptr<float>(span.row) + static_cast<std::size_t>(span.begin) * channels;
    double sum = 0;
    for (int k = 0; k < span.length(); ++k) {
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
