#include "planner/joint/near_search.h"

#include <algorithm>
#include <cmath>

#include "planner/matching/clones.h"

namespace veneer::planner {
namespace {

constexpr std::size_t kLanes = 16;

// Added to `sums`, so that rows need no adding up of their own.
VENEER_CLONES void add_squared_distance(const float* a, const float* b, std::size_t count, float* sums) {
  float lanes[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) lanes[i] = sums[i];
  std::size_t k = 0;
  for (; k + kLanes <= count; k += kLanes)
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float d = a[k + i] - b[k + i];
      lanes[i] += d * d;
    }
  for (std::size_t i = 0; k + i < count; ++i) {
    const float d = a[k + i] - b[k + i];
    lanes[i] += d * d;
  }
  for (std::size_t i = 0; i < kLanes; ++i) sums[i] = lanes[i];
}

}  // namespace

NearSearch::NearSearch(const MatchPatch& patch, const Footprint& footprint, const std::vector<MatchPanel>& panels)
    : patch_(patch),
      footprint_(footprint),
      panels_(panels),
      channels_(static_cast<std::size_t>(patch.features->channels())) {}

void NearSearch::turn_upright(const Pose& from, int reach, std::vector<float>& wood) const {
  const Raster<PanelFrame>& panel = panels_[static_cast<std::size_t>(from.panel)].features;
  const cv::Mat& map = panel.pixels;
  const PixelGrid& grid = patch_.grid;
  const int columns = patch_.pixels.width + 2 * reach, rows = patch_.pixels.height + 2 * reach;
  wood.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * channels_);
  const auto artwork_point = [&](double column, double row) {
    return Point<ArtworkFrame>{grid.resolution.to_mm(Pixels(column)), grid.height - grid.resolution.to_mm(Pixels(row))};
  };
  double column = 0, row = 0;
  panel.to_pixels(footprint_.panel_from_artwork(from) *
                      artwork_point(patch_.pixels.left - reach + 0.5, patch_.pixels.top - reach + 0.5),
                  column, row);
  const double step = panel.resolution.px_per_mm / grid.resolution.px_per_mm;
  const double cos = from.cos * step, sin = from.sin * step;
  const int most_left = std::max(map.cols - 2, 0), most_up = std::max(map.rows - 2, 0);
  const std::ptrdiff_t right = map.cols > 1 ? static_cast<std::ptrdiff_t>(channels_) : 0;
  const std::ptrdiff_t down = map.rows > 1 ? static_cast<std::ptrdiff_t>(map.step1()) : 0;
  float* to = wood.data();
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double x = std::clamp(column + cos * i + sin * j - 0.5, 0.0, map.cols - 1.0);
      const double y = std::clamp(row + cos * j - sin * i - 0.5, 0.0, map.rows - 1.0);
      const int c = std::min(static_cast<int>(x), most_left), r = std::min(static_cast<int>(y), most_up);
      const auto fx = static_cast<float>(x - c), fy = static_cast<float>(y - r);
      const auto* upper = map.ptr<float>(r) + static_cast<std::ptrdiff_t>(c) * static_cast<std::ptrdiff_t>(channels_);
      const auto* lower = upper + down;
      for (std::size_t ch = 0; ch < channels_; ++ch) {
        const auto at = static_cast<std::ptrdiff_t>(ch);
        const float above = upper[at] + fx * (upper[at + right] - upper[at]);
        const float below = lower[at] + fx * (lower[at + right] - lower[at]);
        *to++ = above + fy * (below - above);
      }
    }
  }
}

// Of the patch whose window's upper left pixel lies `right` and `down` pixels into the wood.
float NearSearch::distance(const std::vector<float>& wood, int wood_columns, int right, int down) const {
  const PatchPixels& pixels = patch_.pixels;
  float sums[kLanes] = {};
  for (int i = 0; i < pixels.height; ++i) {
    const PatchPixels::Span span = pixels.rows[static_cast<std::size_t>(i)];
    const auto* target = patch_.features->ptr<float>(pixels.top + i) + static_cast<std::size_t>(span.begin) * channels_;
    const auto first = static_cast<std::size_t>(down + i) * static_cast<std::size_t>(wood_columns) +
                       static_cast<std::size_t>(right + span.begin - pixels.left);
    add_squared_distance(target, wood.data() + first * channels_,
                         static_cast<std::size_t>(span.end - span.begin) * channels_, sums);
  }
  for (std::size_t half = kLanes / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i) sums[i] += sums[i + half];
  return sums[0];
}

double NearSearch::cost(const Pose& at) const {
  std::vector<float> wood;
  turn_upright(at, 0, wood);
  return distance(wood, patch_.pixels.width, 0, 0);
}

std::optional<Place> NearSearch::best(const Pose& from, int reach,
                                      const std::function<bool(const Pose&)>& allowed) const {
  std::vector<float> wood;
  turn_upright(from, reach, wood);
  struct Found {
    float cost;
    int right, down;
  };
  std::vector<Found> found;
  for (int down = 0; down <= 2 * reach; ++down)
    for (int right = 0; right <= 2 * reach; ++right)
      found.push_back({distance(wood, patch_.pixels.width + 2 * reach, right, down), right - reach, down - reach});
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.cost < b.cost; });
  const double pixel = patch_.grid.resolution.to_mm(Pixels(1)).count();
  for (const Found& it : found) {
    Pose pose = from;
    const double x = it.right * pixel, y = -it.down * pixel;
    pose.x += from.cos * x - from.sin * y, pose.y += from.sin * x + from.cos * y;
    if (allowed(pose)) return Place{pose, it.cost};
  }
  return std::nullopt;
}

}  // namespace veneer::planner
