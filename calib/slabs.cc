#include "calib/slabs.h"

#include <opencv2/imgproc.hpp>

namespace veneer::calib {
namespace {

constexpr double kSlab = 4;  // mm of a side that are looked at together

// The side moved to where each slab shows its step, to parts of a pixel. The coarse search leaves up to two pixels at
// its ends.
SeenSide settle(const Stretch& stretch, SeenSide side) {
  constexpr int kMove = 2;        // px
  constexpr double kStray = 1.0;  // px of a slab that does not count
  const int columns = stretch.view().columns();
  const int reach = std::max(2, static_cast<int>(std::lround(0.4 * stretch.view().px())));
  const auto step_at = [&](int slab, int x) {
    const BoardValue before = stretch.mean(slab, x - reach, x), after = stretch.mean(slab, x, x + reach);
    BoardValue step{};
    for (std::size_t k = 0; k < 3; ++k) step[k] = (after[k] - before[k]) / stretch.view().spread()[k];
    return step;
  };
  BoardValue along{};
  for (int i = 0; i < stretch.slabs(); ++i) {
    const BoardValue step = step_at(i, stretch.crossing(i, side.at, side.tilt));
    for (std::size_t k = 0; k < 3; ++k) along[k] += step[k];
  }
  std::vector<cv::Point2d> places;  // slab's middle, from the stretch's; where its step is
  for (int i = 0; i < stretch.slabs(); ++i) {
    const int x = stretch.crossing(i, side.at, side.tilt);
    if (x - kMove - 1 - reach < 0 || x + kMove + 1 + reach > columns) continue;
    std::array<double, 2 * kMove + 3> size{};
    for (int d = -kMove - 1; d <= kMove + 1; ++d) {
      const BoardValue step = step_at(i, x + d);
      size[static_cast<std::size_t>(d + kMove + 1)] = step[0] * along[0] + step[1] * along[1] + step[2] * along[2];
    }
    const auto best = std::max_element(size.begin() + 1, size.end() - 1);
    const double bend = best[-1] - 2 * best[0] + best[1];
    const double peak = bend < 0 ? std::clamp(0.5 * (best[-1] - best[1]) / bend, -0.5, 0.5) : 0;
    places.emplace_back(stretch.from_middle(i), x + static_cast<double>(best - size.begin()) - kMove - 1 + peak);
  }
  for (int pass = 0; pass < 3; ++pass) {
    double n = 0, y = 0, x = 0, yy = 0, yx = 0;
    for (const auto& p : places) {
      if (pass > 0 && std::abs(p.y - side.at - side.tilt * p.x) > kStray) continue;
      n += 1, y += p.x, x += p.y, yy += p.x * p.x, yx += p.x * p.y;
    }
    const double spread = n * yy - y * y;
    if (n < 4 || spread < 1e-6) return side;
    side.tilt = (n * yx - y * x) / spread;
    side.at = (x - side.tilt * y) / n;
  }
  return side;
}

}  // namespace

SlabView::SlabView(const BoardView& view, const cv::Mat& fiducials, bool exchanged)
    : px_(view.px_per_mm), spread_(view.spread) {
  constexpr double kLeastHue = 0.035;  // logarithm
  constexpr double kFalseColour = 2;   // grey levels that a compressed picture is off in hue beside strong edges
  for (std::size_t k = 0; k < 2; ++k)
    hue_[k] = std::max({kLeastHue, 4 * view.spread[k + 1], kFalseColour / view.level});
  for (std::size_t k = 0; k < 3; ++k) {
    cv::Mat plane = exchanged ? cv::Mat(view.planes[k].t()) : view.planes[k].clone();
    plane.setTo(0, exchanged ? cv::Mat(fiducials.t()) : fiducials);
    cv::integral(plane, sums_[k], CV_64F);
  }
}

Stretch::Stretch(const SlabView& view, int from, int to)
    : view_(view),
      from_(from),
      to_(to),
      count_(std::max(3, static_cast<int>((to - from) / (kSlab * view.px())))),
      width_(static_cast<std::size_t>(view.columns()) + 1) {
  for (std::size_t k = 0; k < 3; ++k) {
    const cv::Mat& sums = view.sums(k);
    slabs_[k].reserve(static_cast<std::size_t>(count_) * width_);
    for (int i = 0; i < count_; ++i) {
      const int top = std::clamp(edge(i), 0, sums.rows - 2), bottom = std::clamp(edge(i + 1), top + 1, sums.rows - 1);
      const auto *above = sums.ptr<double>(top), *below = sums.ptr<double>(bottom);
      for (std::size_t x = 0; x < width_; ++x) slabs_[k].push_back((below[x] - above[x]) / (bottom - top));
    }
  }
}

int Stretch::edge(int slab) const {
  return from_ + static_cast<int>(std::lround((to_ - from_) * (static_cast<double>(slab) / count_)));
}

double step_along(const Stretch& stretch, double at, double tilt, double share) {
  const SlabView& view = stretch.view();
  const int count = stretch.slabs();
  const int reach = std::max(2, static_cast<int>(std::lround(0.4 * view.px())));
  std::vector<BoardValue> steps;
  steps.reserve(static_cast<std::size_t>(count));
  BoardValue sum{};
  for (int i = 0; i < count; ++i) {
    const int x = stretch.crossing(i, at, tilt);
    if (x - reach < 0 || x + reach > view.columns()) return 0;
    const BoardValue before = stretch.mean(i, x - reach, x), after = stretch.mean(i, x, x + reach);
    BoardValue& step = steps.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) step[k] = (after[k] - before[k]) / view.spread()[k], sum[k] += step[k];
  }
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  if (length < 1e-9) return 0;
  std::vector<double> along;
  along.reserve(steps.size());
  for (const BoardValue& step : steps)
    along.push_back((step[0] * sum[0] + step[1] * sum[1] + step[2] * sum[2]) / length);
  const auto nth = along.begin() + static_cast<std::ptrdiff_t>(share * (count - 1));
  std::nth_element(along.begin(), nth, along.end());
  return *nth;
}

SeenSide find_side(double at, double outwards, double inwards, const Stretch& stretch, bool outwards_is_less) {
  std::vector<SeenSide> seen;
  double most = 0;
  const double tilt_step = 1 / std::max(1.0, stretch.length() / 2);
  const double from = at - (outwards_is_less ? outwards : inwards), to = at + (outwards_is_less ? inwards : outwards);
  for (double x = from; x <= to; x += 1) {
    SeenSide best{x, 0, 0};
    for (double tilt = -kSteepest; tilt <= kSteepest; tilt += tilt_step) {
      const double step = step_along(stretch, x, tilt, kShare);
      if (step > best.step) best = {x, tilt, step};
    }
    seen.push_back(best), most = std::max(most, best.step);
  }
  SeenSide side{at, 0, 0};
  if (most < kClear) return side;
  const auto count = static_cast<int>(seen.size());
  for (int k = 0; k < count; ++k) {
    const int i = outwards_is_less ? k : count - 1 - k;
    const auto& here = seen[static_cast<std::size_t>(i)];
    if (here.step < kClear || here.step < 0.4 * most) continue;
    bool peak = true;
    for (int d = -3; d <= 3; ++d)
      if (i + d >= 0 && i + d < count) peak = peak && seen[static_cast<std::size_t>(i + d)].step <= here.step;
    if (!peak) continue;
    return settle(stretch, here);
  }
  return side;
}

}  // namespace veneer::calib
