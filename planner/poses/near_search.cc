#include "planner/poses/near_search.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "planner/matching/clones.h"

namespace veneer::planner {
namespace {

constexpr std::size_t kLanes = 16;
// Places near each other are compared by so many rows of the patch, and so many of the best by all rows.
constexpr int kRows = 25, kMeasured = 4;

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

// Where the pixels of an upright window lie in a panel: pixel (i, j) at (column + cos i + sin j, row + cos j - sin i).
struct Upright {
  double column, row, cos, sin;
  int columns, rows;

  double x(int i, int j) const { return column + cos * i + sin * j - 0.5; }
  double y(int i, int j) const { return row + cos * j - sin * i - 0.5; }
  // Whether every pixel has four neighbours on the map.
  bool within(const cv::Mat& map) const {
    for (const int i : {0, columns - 1})
      for (const int j : {0, rows - 1})
        if (!(x(i, j) >= 0 && y(i, j) >= 0 && x(i, j) < map.cols - 2 && y(i, j) < map.rows - 2)) return false;
    return true;
  }
};

// Bilinear; what lies off the map is as its border.
void sample_upright(const cv::Mat& map, const Upright& window, std::size_t channels, float* to) {
  const auto width = static_cast<std::ptrdiff_t>(channels);
  const int most_left = std::max(map.cols - 2, 0), most_up = std::max(map.rows - 2, 0);
  const std::ptrdiff_t right = map.cols > 1 ? width : 0;
  const auto stride = static_cast<std::ptrdiff_t>(map.step1());
  const std::ptrdiff_t down = map.rows > 1 ? stride : 0;
  const auto* first = map.ptr<float>();
  for (int j = 0; j < window.rows; ++j) {
    for (int i = 0; i < window.columns; ++i) {
      const double x = std::clamp(window.x(i, j), 0.0, map.cols - 1.0);
      const double y = std::clamp(window.y(i, j), 0.0, map.rows - 1.0);
      const int c = std::min(static_cast<int>(x), most_left), r = std::min(static_cast<int>(y), most_up);
      const auto fx = static_cast<float>(x - c), fy = static_cast<float>(y - r);
      const auto *upper = first + r * stride + c * width, *lower = upper + down;
      for (std::ptrdiff_t ch = 0; ch < width; ++ch) {
        const float above = upper[ch] + fx * (upper[ch + right] - upper[ch]);
        const float below = lower[ch] + fx * (lower[ch + right] - lower[ch]);
        *to++ = above + fy * (below - above);
      }
    }
  }
}

// The same for two channels and windows that lie well within the map: both channels of both neighbours at once.
void sample_pairs(const cv::Mat& map, const Upright& window, float* to) {
  using Four = float __attribute__((vector_size(16)));
  const auto stride = static_cast<std::ptrdiff_t>(map.step1());
  const auto* first = map.ptr<float>();
  for (int j = 0; j < window.rows; ++j) {
    const double left = window.x(0, j), top = window.y(0, j);
    for (int i = 0; i < window.columns; ++i, to += 2) {
      const double x = left + window.cos * i, y = top - window.sin * i;
      const int c = static_cast<int>(x), r = static_cast<int>(y);
      const auto fx = static_cast<float>(x - c), fy = static_cast<float>(y - r);
      const auto* from = first + r * stride + 2 * static_cast<std::ptrdiff_t>(c);
      Four upper, lower;
      std::memcpy(&upper, from, sizeof upper), std::memcpy(&lower, from + stride, sizeof lower);
      const Four between = upper + fy * (lower - upper);
      to[0] = between[0] + fx * (between[2] - between[0]);
      to[1] = between[1] + fx * (between[3] - between[1]);
    }
  }
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
  const Upright upright{column, row, from.cos * step, from.sin * step, columns, rows};
  // Nearly always the window lies well within the panel and there are two channels.
  if (channels_ == 2 && upright.within(map))
    sample_pairs(map, upright, wood.data());
  else
    sample_upright(map, upright, channels_, wood.data());
}

// Of the patch whose window's upper left pixel lies `right` and `down` pixels into the wood; of every `step`th row.
float NearSearch::distance(const std::vector<float>& wood, int wood_columns, int right, int down, int step) const {
  const PatchPixels& pixels = patch_.pixels;
  float sums[kLanes] = {};
  for (const PatchPixels::Span& span : pixels.spans) {
    const int i = span.row - pixels.top;
    if (i % step != step / 2) continue;
    const auto* target = patch_.features->ptr<float>(span.row) + static_cast<std::size_t>(span.begin) * channels_;
    const auto first = static_cast<std::size_t>(down + i) * static_cast<std::size_t>(wood_columns) +
                       static_cast<std::size_t>(right + span.begin - pixels.left);
    add_squared_distance(target, wood.data() + first * channels_, static_cast<std::size_t>(span.length()) * channels_,
                         sums);
  }
  for (std::size_t half = kLanes / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i) sums[i] += sums[i + half];
  return sums[0];
}

double NearSearch::cost(const Pose& at) const {
  std::vector<float> wood;
  turn_upright(at, 0, wood);
  return distance(wood, patch_.pixels.width, 0, 0, 1);
}

std::optional<Candidate> NearSearch::best(const Pose& from, int reach,
                                          const std::function<bool(const Pose&)>& allowed) const {
  std::vector<float> wood;
  turn_upright(from, reach, wood);
  const int columns = patch_.pixels.width + 2 * reach, step = std::max(1, patch_.pixels.height / kRows);
  struct Found {
    float cost;
    int right, down;
  };
  std::vector<Found> found;
  for (int down = 0; down <= 2 * reach; ++down)
    for (int right = 0; right <= 2 * reach; ++right)
      found.push_back({distance(wood, columns, right, down, step), right, down});
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.cost < b.cost; });
  const double pixel = patch_.grid.resolution.to_mm(Pixels(1)).count();
  std::optional<Candidate> best;
  int measured = 0;
  for (const Found& it : found) {
    Pose pose = from;
    const double x = (it.right - reach) * pixel, y = (reach - it.down) * pixel;
    pose.x += from.cos * x - from.sin * y, pose.y += from.sin * x + from.cos * y;
    if (!allowed(pose)) continue;
    const double cost = step == 1 ? it.cost : distance(wood, columns, it.right, it.down, 1);
    if (!best || cost < best->cost) best = Candidate{pose, cost};
    if (step == 1 || ++measured == kMeasured) break;
  }
  return best;
}

}  // namespace veneer::planner
