#include "calib/round_rim.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace veneer::calib {
namespace {

constexpr int kRimSides = 16, kRays = 2;  // rays a side
constexpr std::size_t kHidden = 3;        // sides whose rim a crack, the grain or another head may hide
constexpr std::size_t kLitSides = 5;      // the same of a countersink, whose lit slope is as light as the wood
constexpr double kWide = 0.45;            // mm on either side of a rim that it is told by
constexpr double kNarrow = 0.35;          // mm on either side of a rim, over which a sharp one shows most of its step
constexpr double kFull = 1.0;             // mm, the same for all of a soft one's
constexpr double kSoft = 0.6;             // share of the step below which a rim is soft
constexpr double kSmallest = 0.8;         // mm, radius
constexpr double kLargest = 5.5;          // mm, radius
constexpr double kOutermost = 2.0;        // step of a rim that lies farther out than the clearest: it counts before it

using Value = std::array<double, 3>;

Value colour_at(const BoardView& view, double x, double y) {
  const int c = std::clamp(static_cast<int>(x), 0, view.planes[0].cols - 1),
            r = std::clamp(static_cast<int>(y), 0, view.planes[0].rows - 1);
  return {view.planes[0].at<float>(r, c), view.planes[1].at<float>(r, c), view.planes[2].at<float>(r, c)};
}

struct SeenRim {
  double radius = 0, step = 0;
};

// Steps at circles about one centre. Radii are in half pixels.
class RimProfiles {
 public:
  RimProfiles(const BoardView& view, const Value& usual, const cv::Point2d& centre, double largest)
      : clearly_darker_(kClearlyDarker / usual[0]),
        wide_(std::max(2, static_cast<int>(std::lround(2 * kWide * view.px_per_mm)))),
        count_(static_cast<int>(2 * largest) + wide_ + 2) {
    sums_.resize(static_cast<std::size_t>(kRimSides) * static_cast<std::size_t>(count_ + 1));
    for (int side = 0; side < kRimSides; ++side) {
      std::array<cv::Point2d, kRays> ways;
      for (int ray = 0; ray < kRays; ++ray) {
        const double way = 2 * CV_PI * (side + (ray + 0.5) / kRays) / kRimSides;
        ways[static_cast<std::size_t>(ray)] = {std::cos(way), std::sin(way)};
      }
      for (int i = 0; i < count_; ++i) {
        Value& sum = sums_[index(side, i + 1)];
        sum = sums_[index(side, i)];
        for (const cv::Point2d& way : ways) {
          const double radius = 0.5 * i + 0.25;
          const Value level = colour_at(view, centre.x + radius * way.x, centre.y + radius * way.y);
          for (std::size_t k = 0; k < 3; ++k) sum[k] += level[k] / (kRays * usual[k]);
        }
      }
    }
  }

  // What all but `hidden` sides show at half the radius `at`, in the direction of their mean.
  double step(int at, std::size_t hidden) const {
    std::array<Value, kRimSides> steps;
    Value sum{};
    const int within = std::min(wide_, at);
    for (int side = 0; side < kRimSides; ++side)
      for (std::size_t k = 0; k < 3; ++k) {
        const double middle = sums_[index(side, at)][k];
        double& step = steps[static_cast<std::size_t>(side)][k];
        step = (sums_[index(side, at + wide_)][k] - middle) / wide_ -
               (middle - sums_[index(side, at - within)][k]) / within;
        sum[k] += step;
      }
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    if (length < 1e-9) return 0;
    std::array<double, kRimSides> along;
    for (std::size_t i = 0; i < kRimSides; ++i)
      along[i] = (steps[i][0] * sum[0] + steps[i][1] * sum[1] + steps[i][2] * sum[2]) / length;
    std::nth_element(along.begin(), along.begin() + static_cast<std::ptrdiff_t>(hidden), along.end());
    return along[hidden];
  }

  // Whether the mean of all sides is darker within.
  bool dark(int at) const {
    const int within = std::min(wide_, at);
    double rise = 0;
    for (int side = 0; side < kRimSides; ++side)
      rise += (sums_[index(side, at + wide_)][0] - sums_[index(side, at)][0]) / wide_ -
              (sums_[index(side, at)][0] - sums_[index(side, at - within)][0]) / within;
    return rise > 0;
  }

  // Whether the inner half of the circle is clearly darker than its outer half: an opening is shaded along its rim, and
  // what lies beneath is lighter in its middle, or all of it is alike.
  bool darkest_within(int at) const {
    double inner = 0, outer = 0;
    for (int side = 0; side < kRimSides; ++side) {
      const double half = sums_[index(side, at / 2)][0];
      inner += half / std::max(1, at / 2), outer += (sums_[index(side, at)][0] - half) / std::max(1, at - at / 2);
    }
    return inner + kRimSides * clearly_darker_ < outer;
  }

  // The share of a dark round's step that its rim shows within kNarrow, each where it is greatest near `at`: the middle
  // one of all sides.
  double sharpness(int at, double px) const {
    const int narrow = std::max(2, static_cast<int>(std::lround(2 * kNarrow * px))),
              full = static_cast<int>(std::lround(2 * kFull * px));
    std::array<double, kRimSides> out{};
    const auto rise = [&](int side, int i, int width) {
      const int beyond = std::min(width, count_ - i), within = std::min(width, i);
      return (sums_[index(side, i + beyond)][0] - sums_[index(side, i)][0]) / beyond -
             (sums_[index(side, i)][0] - sums_[index(side, i - within)][0]) / within;
    };
    for (int side = 0; side < kRimSides; ++side) {
      double sharp = 0, whole = 1e-9;
      for (int i = std::max(2, at - full); i <= std::min(count_ - 2, at + full); ++i)
        sharp = std::max(sharp, rise(side, i, narrow)), whole = std::max(whole, rise(side, i, full));
      out[static_cast<std::size_t>(side)] = sharp / whole;
    }
    std::nth_element(out.begin(), out.begin() + kRimSides / 2, out.end());
    return out[kRimSides / 2];
  }

  SeenRim clearest(double smallest, double largest, int stride) const {
    SeenRim best;
    for (int at = static_cast<int>(2 * smallest); at <= static_cast<int>(2 * largest); at += stride)
      if (const double here = step(at, kHidden); here > best.step) best = {0.5 * at, here};
    return best;
  }

 private:
  std::size_t index(int side, int i) const {
    return static_cast<std::size_t>(side) * static_cast<std::size_t>(count_ + 1) + static_cast<std::size_t>(i);
  }

  double clearly_darker_;
  int wide_, count_;
  std::vector<Value> sums_;
};

// Whether most of the inner half of a circle is the scanner's black.
bool is_nothing_seen(const BoardView& view, const ScrewSpot& circle) {
  if (view.black.empty()) return false;
  const double half = circle.diameter / 4;
  const cv::Rect around = cv::Rect(static_cast<int>(circle.centre.x - half), static_cast<int>(circle.centre.y - half),
                                   static_cast<int>(2 * half) + 1, static_cast<int>(2 * half) + 1) &
                          cv::Rect({}, view.black.size());
  int all = 0, black = 0;
  for (int r = around.y; r < around.br().y; ++r)
    for (int c = around.x; c < around.br().x; ++c) {
      if (std::hypot(c + 0.5 - circle.centre.x, r + 0.5 - circle.centre.y) > half) continue;
      ++all, black += view.black.at<std::uint8_t>(r, c) != 0 ? 1 : 0;
    }
  return 2 * black > all;
}

struct SeenColour {
  Value value{};    // as the scanner saw it, not as told from the board
  double seen = 0;  // share of the place that is wood
};

// The mean of what lies on the strip between two distances from `centre`.
SeenColour colour_between(const BoardView& view, const cv::Mat& strip, const cv::Point2d& centre, double from,
                          double to) {
  SeenColour out;
  double all = 0, count = 0;
  const int top = static_cast<int>(std::floor(centre.y - to)), left = static_cast<int>(std::floor(centre.x - to));
  const cv::Rect bounds({}, strip.size());
  for (int r = top; r <= centre.y + to; ++r)
    for (int c = left; c <= centre.x + to; ++c) {
      const double at = std::hypot(c + 0.5 - centre.x, r + 0.5 - centre.y);
      if (at < from || at > to) continue;
      all += 1;
      if (!bounds.contains({c, r}) || strip.at<std::uint8_t>(r, c) == 0) continue;
      count += 1;
      for (std::size_t k = 0; k < 3; ++k) out.value[k] += view.planes[k].at<float>(r, c);
    }
  if (count == 0) return out;
  // The planes are told from the board, whose own hue nothing else has lost.
  for (std::size_t k = 0; k < 3; ++k) out.value[k] = out.value[k] / count + view.board[k];
  out.seen = count / all;
  return out;
}

double hue_of(const Value& value) { return std::hypot(value[1], value[2]); }

// What a colour becomes in so much less light that its lightness is `lightness`: what the scanner's black adds takes
// hue from what is dark.
Value dimmed(const Value& value, double lightness) {
  const double green = value[0] - (value[1] - value[2]) / 3;
  Value levels = {green - value[2], green, green + value[1]};  // blue, green, red
  for (double& level : levels) level = std::max(0.0, std::exp(level) - kScannerBlack);
  const auto in_light = [&](double light) {
    Value out;
    for (std::size_t k = 0; k < 3; ++k) out[k] = std::log(light * levels[k] + kScannerBlack);
    return Value{(out[0] + out[1] + out[2]) / 3, out[2] - out[1], out[1] - out[0]};
  };
  double least = 0, most = 1;
  for (int i = 0; i < 20; ++i) {
    const double light = (least + most) / 2;
    (in_light(light)[0] < lightness ? least : most) = light;
  }
  return in_light(most);
}

}  // namespace

RimScale::RimScale(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  const int wide = std::max(1, static_cast<int>(std::lround(kWide * view.px_per_mm)));
  std::array<std::vector<double>, 3> changes;
  for (int r = box.y; r + wide < box.br().y; r += 3)
    for (int c = box.x; c + wide < box.br().x; c += 3) {
      if (strip.at<std::uint8_t>(r, c) == 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const double here = view.planes[k].at<float>(r, c);
        if (strip.at<std::uint8_t>(r + wide, c) != 0)
          changes[k].push_back(std::abs(view.planes[k].at<float>(r + wide, c) - here));
        if (strip.at<std::uint8_t>(r, c + wide) != 0)
          changes[k].push_back(std::abs(view.planes[k].at<float>(r, c + wide) - here));
      }
    }
  constexpr Value kLeast = {0.02, 0.01, 0.01};  // logarithms
  for (std::size_t k = 0; k < 3; ++k) {
    usual_[k] = kLeast[k];
    if (changes[k].empty()) continue;
    const auto nth = changes[k].begin() + static_cast<std::ptrdiff_t>(0.7 * static_cast<double>(changes[k].size()));
    std::nth_element(changes[k].begin(), nth, changes[k].end());
    usual_[k] = std::max(usual_[k], *nth);
  }
}

RoundRim find_rim(const BoardView& view, const RimScale& scale, const ScrewSpot& spot) {
  const double px = view.px_per_mm, radius = spot.diameter / 2;
  const double smallest = std::max(kSmallest * px, 0.45 * radius),
               largest = std::min(kLargest * px, std::max(2.1 * radius, radius + 1.0 * px));
  const double reach = std::max(0.8 * px, 0.9 * radius);
  RoundRim best{spot};
  const auto look = [&](const cv::Point2d& centre, int radii) {
    const RimProfiles profiles(view, scale.usual(), centre, largest);
    const SeenRim rim = profiles.clearest(smallest, largest, radii);
    if (rim.step > best.step) best.circle = {centre, 2 * rim.radius}, best.step = rim.step;
  };
  const double stride = std::max(1.5, reach / 5);
  for (double y = -reach; y <= reach; y += stride)
    for (double x = -reach; x <= reach; x += stride)
      if (std::hypot(x, y) <= reach) look(spot.centre + cv::Point2d(x, y), 2);
  for (double finer = 0.5 * stride; finer > 0.4; finer *= 0.5) {
    const cv::Point2d coarse = best.circle.centre;
    for (double y = -finer; y <= finer; y += finer)
      for (double x = -finer; x <= finer; x += finer) look(coarse + cv::Point2d(x, y), 1);
  }
  // A spot may be wider than the profiles reach.
  if (best.step <= 0) return best;
  // A head has rims of its own within, and lies in a countersink: the outermost rim is where the wood begins.
  const RimProfiles profiles(view, scale.usual(), best.circle.centre, largest);
  const int clearest = static_cast<int>(best.circle.diameter);
  best.dark = profiles.dark(clearest) && profiles.darkest_within(clearest);
  best.soft = profiles.sharpness(clearest, px) < kSoft;
  best.nothing_seen = is_nothing_seen(view, best.circle);
  for (int at = static_cast<int>(2 * largest); at > clearest; --at)
    if (const double step = profiles.step(at, kLitSides);
        step > kOutermost && step >= profiles.step(at - 1, kLitSides)) {
      best.circle.diameter = at;
      break;
    }
  return best;
}

bool is_grey_in_dark_wood(const BoardView& view, const cv::Mat& strip, const ScrewSpot& circle) {
  constexpr double kLeft = 0.75;                          // share of the hue that the wood would have
  constexpr double kDark = 4.75;                          // logarithm of the lightness; oak and pine are paler
  constexpr double kMostWood = 0.5;                       // of what is looked at
  constexpr double kInner = 0.8, kFrom = 0.4, kTo = 1.4;  // of the radius; mm beyond it
  const double radius = circle.diameter / 2, px = view.px_per_mm;
  const SeenColour within = colour_between(view, strip, circle.centre, 0, kInner * radius),
                   wood = colour_between(view, strip, circle.centre, radius + kFrom * px, radius + kTo * px);
  if (within.seen < kMostWood || wood.seen < kMostWood) return false;
  if (wood.value[0] > kDark || within.value[0] > wood.value[0] || hue_of(wood.value) < kHasHue) return false;
  return hue_of(within.value) < kLeft * hue_of(dimmed(wood.value, within.value[0]));
}

}  // namespace veneer::calib
