#include "calib/odd_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "calib/work_map.h"

namespace veneer::calib {
namespace {

// Shares of a strip's places whose contrast is usual on it. A long crack in a narrow strip is a tenth of its places.
constexpr double kUsualOfRounds = 0.97, kUsualOfLines = 0.85;
// Logarithms; contrast below is noise on any wood. Hues are steadier than lightness.
constexpr double kLeastOfRounds = 0.06;
constexpr std::array<double, 3> kLeastOfLines = {0.03, 0.02, 0.02};

double quantile(const cv::Mat& values, const cv::Mat& where, double share) {
  std::vector<float> all;
  for (int r = 0; r < values.rows; r += 2)
    for (int c = 0; c < values.cols; c += 2)
      if (where.at<std::uint8_t>(r, c) != 0) all.push_back(values.at<float>(r, c));
  if (all.empty()) return 0;
  const auto nth = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
  std::nth_element(all.begin(), nth, all.end());
  return *nth;
}

// Sums over rectangles around each place; beyond the picture nothing is added.
cv::Mat sum_around(const cv::Mat& values, cv::Size size) {
  cv::Mat out;
  cv::boxFilter(values, out, CV_32F, size, {-1, -1}, false, cv::BORDER_CONSTANT);
  return out;
}
int odd(double length) { return 2 * static_cast<int>(std::lround((length - 1) / 2)) + 1; }

// How much bolder than on the whole strip a contrast is around each place, from `near` to `far`: at least 1. Single
// marks count no more than three times what is usual.
cv::Mat boldness(const cv::Mat& contrast, const cv::Mat& where, double usual, cv::Size near, cv::Size far) {
  cv::Mat wood, bold = cv::min(contrast, 3 * usual);
  where.convertTo(wood, CV_32F, 1.0 / 255);
  bold = bold.mul(wood);
  const double mean = cv::sum(bold)[0] / std::max(1.0, cv::sum(wood)[0]);
  cv::Mat around = sum_around(bold, far) - sum_around(bold, near);
  around /= cv::max((sum_around(wood, far) - sum_around(wood, near)) * mean, 1e-6F);
  return cv::max(around, 1.0F);
}

// Where a contrast, none of it below 0, is larger than usual, 1 = as much as is usual. A mark stands alone: where bold
// figure lies `near` to `far` from it, as much more is usual.
void add_oddness(cv::Mat contrast, const cv::Mat& where, double share, double least, cv::Size near, cv::Size far,
                 cv::Mat& oddness) {
  const double usual = std::max(least, quantile(contrast, where, share));
  contrast /= boldness(contrast, where, usual, near, far) * usual;
  oddness = oddness.empty() ? contrast : cv::Mat(cv::max(oddness, contrast));
}

// Whether the inside of a round differs in one and the same way from every side of the ring around it, in one plane: a
// line of the grain runs on beyond it.
bool is_alone(const BoardView& view, const cv::Point2d& centre, double radius) {
  constexpr int kSides = 8;
  constexpr double kLeastShare = 0.4;  // of the mean contrast that each side shows
  const double px = view.px_per_mm, near = (radius + 0.35) * px, far = (radius + 1.1) * px;
  for (const cv::Mat& plane : view.planes) {
    double inside = 0, places = 0;
    std::array<double, kSides> side{}, count{};
    const int reach = static_cast<int>(std::ceil(far));
    for (int r = -reach; r <= reach; ++r)
      for (int c = -reach; c <= reach; ++c) {
        const int x = static_cast<int>(centre.x) + c, y = static_cast<int>(centre.y) + r;
        if (x < 0 || y < 0 || x >= plane.cols || y >= plane.rows) continue;
        const double d = std::hypot(c, r), level = plane.at<float>(y, x);
        if (d < 0.7 * radius * px) inside += level, places += 1;
        if (d < near || d > far) continue;
        const auto k = static_cast<std::size_t>((std::atan2(r, c) / (2 * CV_PI) + 1) * kSides) % kSides;
        side[k] += level, count[k] += 1;
      }
    double mean = 0;
    for (std::size_t k = 0; k < kSides; ++k) {
      side[k] = inside / std::max(1.0, places) - side[k] / std::max(1.0, count[k]);
      mean += side[k] / kSides;
    }
    const bool all = std::ranges::all_of(side, [&](double s) { return s * mean > kLeastShare * mean * mean; });
    if (all && std::abs(mean) > kLeastOfRounds) return true;
  }
  return false;
}

}  // namespace

SpotContrast::SpotContrast(const BoardView& view, const cv::Mat& strip, const cv::Rect& box, double radius)
    : radius_(radius) {
  constexpr double kGap = 0.3, kRing = 1.2;  // mm beyond the round where its surroundings begin and end
  constexpr double kNearby = 9;              // mm around it that must be calmer than the round
  const double px = view.px_per_mm;
  // A square of the round's own area less its rim.
  const int inner = odd(1.5 * radius * px), near = odd(2 * (radius + kGap) * px), far = odd(2 * (radius + kRing) * px),
            wide = odd(2 * kNearby * px);
  cv::Mat wood;
  strip(box).convertTo(wood, CV_32F, 1.0 / 255);
  const cv::Mat inside = sum_around(wood, {inner, inner}),
                around = sum_around(wood, {far, far}) - sum_around(wood, {near, near});
  // Where little of the ring is wood nothing is known.
  const cv::Mat known = (strip(box) != 0) & (around > 0.4F * static_cast<float>(far * far - near * near));
  for (const cv::Mat& plane : view.planes) {
    const cv::Mat own = plane(box).mul(wood);
    cv::Mat contrast = sum_around(own, {inner, inner}) / cv::max(inside, 1.0F) -
                       (sum_around(own, {far, far}) - sum_around(own, {near, near})) / cv::max(around, 1.0F);
    contrast.setTo(0, ~known);
    add_oddness(cv::abs(contrast), known, kUsualOfRounds, kLeastOfRounds, {far, far}, {wide, wide}, oddness_);
  }
}

std::vector<ScrewSpot> find_odd_spots(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  constexpr double kOdd = 2.75;
  std::vector<ScrewSpot> out;
  const double px = view.px_per_mm;
  for (const double radius : {1.0, 1.5, 2.2}) {
    cv::Mat oddness = SpotContrast(view, strip, box, radius).oddness();
    for (int i = 0; i < 20; ++i) {
      double most = 0;
      cv::Point at;
      cv::minMaxLoc(oddness, nullptr, &most, nullptr, &at);
      if (most < kOdd) break;
      const cv::Point2d centre = cv::Point2d(box.tl() + at) + cv::Point2d(0.5, 0.5);
      if (is_alone(view, centre, radius)) out.push_back({centre, 2 * (radius + 0.4) * px});
      cv::circle(oddness, at, static_cast<int>(radius * px), cv::Scalar(0), cv::FILLED);
    }
  }
  return out;
}

namespace {

// 255 where lines are odd. What is seen in many places is figure, however bold: then only what is bolder still is odd.
cv::Mat few_lines(const cv::Mat& oddness, double px) {
  constexpr double kOdd = 4, kOddest = 12, kBolder = 1.25;
  constexpr int kMost = 4;         // lines that may be cracks
  constexpr double kShortest = 5;  // mm; what is shorter is a bend of the figure
  for (double odd = kOdd;; odd *= kBolder) {
    cv::Mat found = oddness > odd, joined, labels, stats, centres;
    // A line that is seen with interruptions is one.
    cv::morphologyEx(found, joined, cv::MORPH_CLOSE, round_kernel(2 * px));
    const int count = cv::connectedComponentsWithStats(joined, labels, stats, centres, 8);
    if (count - 1 > kMost && odd * kBolder <= kOddest) continue;
    std::vector<std::uint8_t> is_long(static_cast<std::size_t>(count), 0);
    for (int i = 1; i < count; ++i)
      is_long[static_cast<std::size_t>(i)] =
          std::hypot(stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT)) >= kShortest * px ? 1
                                                                                                                  : 0;
    for (int r = 0; r < found.rows; ++r)
      for (int c = 0; c < found.cols; ++c)
        if (is_long[static_cast<std::size_t>(labels.at<int>(r, c))] == 0) found.at<std::uint8_t>(r, c) = 0;
    return found;
  }
}

// Sums of three planes over places of which `area` counts.
cv::Mat mean_of(const cv::Mat& sums, const cv::Mat& area) {
  cv::Mat share;
  cv::merge(std::vector(3, cv::Mat(1 / cv::max(area, 1.0F))), share);
  return sums.mul(share);
}

// What lies `columns` to the left of each place; beyond the picture there is nothing.
cv::Mat moved(const cv::Mat& values, int columns) {
  cv::Mat out = cv::Mat::zeros(values.size(), values.type());
  const int reach = std::min(std::abs(columns), values.cols), rest = values.cols - reach;
  const cv::Rect from(columns > 0 ? 0 : reach, 0, rest, values.rows), to(columns > 0 ? reach : 0, 0, rest, values.rows);
  values(from).copyTo(out(to));
  return out;
}

}  // namespace

cv::Mat find_odd_lines(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  constexpr double kLength = 8;                          // mm
  constexpr std::array<double, 2> kWidths = {0.5, 1.0};  // mm; what is beside a line is as wide
  constexpr double kSteepest = 0.12, kTilt = 0.06;
  constexpr double kAlone = 2, kNearby = 8;  // mm to either side, between which the wood must be calmer than the line
  constexpr double kShrink = 0.5;            // a line is long: half the pixels show it as well
  const double px = view.px_per_mm * kShrink;
  cv::Mat lines = cv::Mat::zeros(strip.size(), CV_8UC1), small_strip, small_planes;
  cv::resize(strip(box), small_strip, {}, kShrink, kShrink, cv::INTER_NEAREST);
  // A crack may be as dark as its wood and still not as grey, so all planes are looked at.
  std::vector<cv::Mat> planes;
  for (const cv::Mat& plane : view.planes) planes.push_back(plane(box));
  cv::merge(planes, small_planes);
  cv::resize(small_planes, small_planes, small_strip.size(), 0, 0, cv::INTER_AREA);
  cv::Mat odd_lines = cv::Mat::zeros(small_strip.size(), CV_32FC1);
  for (const bool lying : {false, true}) {
    const auto turned = [&](const cv::Mat& m) { return lying ? cv::Mat(m.t()) : m; };
    const cv::Mat mask = turned(small_strip);
    if (mask.rows < 1.5 * kLength * px) continue;
    cv::Mat wood, wood3;
    mask.convertTo(wood, CV_32F, 1.0 / 255);
    cv::merge(std::vector(3, wood), wood3);
    const cv::Mat own = turned(small_planes).mul(wood3);
    const int tall = odd(kLength * px);
    std::array<cv::Mat, kWidths.size()> best;
    for (cv::Mat& contrast : best) contrast = cv::Mat::zeros(mask.size(), CV_32FC3);
    for (double tilt = -kSteepest; tilt < kSteepest + 1e-9; tilt += kTilt) {
      // Sheared, so that lines of this tilt stand upright.
      const cv::Matx23d upright(1, tilt, -tilt * mask.rows / 2, 0, 1, 0), back(1, -tilt, tilt * mask.rows / 2, 0, 1, 0);
      cv::Mat sheared, where;
      cv::warpAffine(own, sheared, upright, mask.size());
      cv::warpAffine(wood, where, upright, mask.size());
      for (std::size_t i = 0; i < kWidths.size(); ++i) {
        // A line differs from both of its sides in the same way: the shade along a strip's side from one only.
        const int narrow = odd(kWidths[i] * px), beside = odd(1.1 * kWidths[i] * px), apart = (narrow + beside) / 2;
        const cv::Mat in_area = sum_around(where, {narrow, tall}), side_area = sum_around(where, {beside, tall});
        const cv::Mat in = mean_of(sum_around(sheared, {narrow, tall}), in_area),
                      side = mean_of(sum_around(sheared, {beside, tall}), side_area);
        const cv::Mat side_known = side_area >= 0.5F * static_cast<float>(beside * tall);
        const cv::Mat known = (in_area >= 0.5F * static_cast<float>(narrow * tall)) & moved(side_known, apart) &
                              moved(side_known, -apart);
        const cv::Mat left = in - moved(side, apart), right = in - moved(side, -apart);
        cv::Mat lighter, darker, contrast;
        cv::min(left, right, lighter), cv::max(left, right, darker);
        cv::max(lighter, cv::Mat(-darker), contrast);
        cv::max(contrast, cv::Scalar::all(0), contrast);
        contrast.setTo(cv::Scalar::all(0), ~known);
        cv::warpAffine(contrast, contrast, back, mask.size());
        best[i] = cv::max(best[i], contrast);
      }
    }
    const cv::Size near(odd(2 * kAlone * px), tall), far(odd(2 * kNearby * px), tall);
    for (const cv::Mat& contrast : best) {
      cv::Mat oddness;
      cv::split(contrast, planes);
      for (std::size_t k = 0; k < 3; ++k)
        add_oddness(planes[k], mask, kUsualOfLines, kLeastOfLines[k], near, far, oddness);
      oddness.setTo(0, ~mask);
      odd_lines = cv::max(odd_lines, turned(oddness));
    }
  }
  cv::Mat grown;
  cv::resize(few_lines(odd_lines, px), grown, box.size(), 0, 0, cv::INTER_NEAREST);
  lines(box) |= grown;
  return lines;
}

}  // namespace veneer::calib
