#include "calib/lid_holes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "calib/work_map.h"

namespace veneer::calib {
namespace {

constexpr int kLidSides = 16;
constexpr std::size_t kLidHidden = 2;                   // sides that dust or a crack may hide
constexpr double kFromRadius = 0.75, kToRadius = 1.45;  // mm, of the shade along the rim
constexpr double kShadeWidth = 0.25;                    // mm
constexpr double kRimBeyond = 0.3;                      // mm from the middle of the shade to the rim
constexpr double kLeastShade = 0.12;                    // logarithm by which every side is darker than the middle
constexpr double kSmooth = 8;                           // times that as much as the places of one ring differ

// How a place looks as a hole's middle.
struct LidDisc {
  cv::Point2d centre;
  double radius = 0;  // px
  double shade = 0;   // by which all but a few sides are darker than the middle, logarithm
  double smooth = 0;  // times as much as the places of one ring differ
};

class DiscProbe {
 public:
  explicit DiscProbe(const BoardView& view) : lightness_(view.planes[0]), px_(view.px_per_mm) {
    for (int side = 0; side < kLidSides; ++side)
      for (int ray = 0; ray < kRays; ++ray) {
        const double way = 2 * CV_PI * (side + (ray - 1) / 3.0) / kLidSides;
        ways_[static_cast<std::size_t>(side * kRays + ray)] = {std::cos(way), std::sin(way)};
      }
  }

  LidDisc at(const cv::Point2d& centre) const {
    LidDisc best{centre};
    for (double radius = kFromRadius; radius < kToRadius + 1e-9; radius += 0.1) {
      const LidDisc here = look(centre, radius * px_);
      if (here.shade >= kLeastShade ? here.smooth > best.smooth : best.shade < kLeastShade && here.shade > best.shade)
        best = here;
    }
    return best;
  }

 private:
  static constexpr int kRays = 3;  // a side

  double level(double x, double y) const {
    const int c = std::clamp(static_cast<int>(x), 0, lightness_.cols - 1),
              r = std::clamp(static_cast<int>(y), 0, lightness_.rows - 1);
    return lightness_.at<float>(r, c);
  }

  LidDisc look(const cv::Point2d& centre, double radius) const {
    constexpr double kMiddle = 0.45;  // of the radius
    const double inner = kMiddle * radius;
    double middle = 0;
    int count = 0;
    for (double y = -std::floor(inner); y <= inner; y += 1)
      for (double x = -std::floor(inner); x <= inner; x += 1)
        if (x * x + y * y <= inner * inner) middle += level(centre.x + x, centre.y + y), ++count;
    middle /= std::max(1, count);
    LidDisc out{centre, radius};
    std::array<double, kLidSides> darker{};
    for (int i = 0; i < kLidSides * kRays; ++i) {
      const cv::Point2d& way = ways_[static_cast<std::size_t>(i)];
      double sum = 0;
      for (const double off : {-0.5, 0.0, 0.5}) {
        const double reach = radius + off * kShadeWidth * px_;
        sum += level(centre.x + reach * way.x, centre.y + reach * way.y) / 3;
      }
      darker[static_cast<std::size_t>(i / kRays)] += (middle - sum) / kRays;
    }
    std::nth_element(darker.begin(), darker.begin() + kLidHidden, darker.end());
    out.shade = darker[kLidHidden];
    if (out.shade < kLeastShade) return out;
    double spread = 0;
    int rings = 0;
    for (double reach = 0.2 * px_; reach < radius - 0.05 * px_; reach += 0.15 * px_, ++rings) {
      double sum = 0, squares = 0;
      for (int side = 0; side < kLidSides; ++side) {
        const cv::Point2d& way = ways_[static_cast<std::size_t>(side * kRays + 1)];
        const double here = level(centre.x + reach * way.x, centre.y + reach * way.y);
        sum += here / kLidSides, squares += here * here / kLidSides;
      }
      spread += std::max(0.0, squares - sum * sum);
    }
    constexpr double kNoise = 0.005;  // logarithm
    out.smooth = out.shade / std::max(kNoise, std::sqrt(spread / std::max(1, rings)));
    return out;
  }

  const cv::Mat& lightness_;
  double px_;
  std::array<cv::Point2d, static_cast<std::size_t>(kLidSides* kRays)> ways_;
};

// Local maxima of how much lighter a place is than what lies around it.
std::vector<cv::Point> light_places(const cv::Mat& lightness, const cv::Mat& deep, double px) {
  constexpr double kInner = 0.35, kOuter = 1.1, kApart = 0.5;  // mm
  constexpr double kLighter = 0.06;                            // logarithm
  constexpr double kWithin = 1.4;                              // mm from the strip's sides
  const int in = 2 * static_cast<int>(kInner * px) + 1, out = 2 * static_cast<int>(kOuter * px) + 1;
  cv::Mat contrast, around, peak;
  cv::boxFilter(lightness, contrast, CV_32F, {in, in});
  cv::boxFilter(lightness, around, CV_32F, {out, out});
  contrast -= around;
  cv::dilate(contrast, peak, round_kernel(kApart * px));
  std::vector<cv::Point> places;
  for (int r = 0; r < contrast.rows; ++r)
    for (int c = 0; c < contrast.cols; ++c) {
      const float here = contrast.at<float>(r, c);
      if (here >= kLighter && here >= peak.at<float>(r, c) && deep.at<float>(r, c) >= kWithin * px)
        places.emplace_back(c, r);
    }
  return places;
}

}  // namespace

std::vector<ScrewSpot> find_lid_holes(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  constexpr double kWorthALook = 0.3;  // of what a hole's shade and smoothness must be at its middle's own pixel
  const double px = view.px_per_mm;
  cv::Mat deep;
  cv::distanceTransform(strip(box), deep, cv::DIST_L2, 3);
  const DiscProbe probe(view);
  std::vector<ScrewSpot> out;
  for (const cv::Point& place : light_places(view.planes[0](box), deep, px)) {
    LidDisc best = probe.at(cv::Point2d(box.tl() + place) + cv::Point2d(0.5, 0.5));
    if (best.shade < kWorthALook * kLeastShade) continue;
    for (const double step : {1.0, 1.0, 0.5}) {
      const cv::Point2d from = best.centre;
      for (double y = -step; y <= step; y += step)
        for (double x = -step; x <= step; x += step)
          if (const LidDisc here = probe.at(from + cv::Point2d(x, y));
              here.smooth > best.smooth || (best.smooth <= 0 && here.shade > best.shade))
            best = here;
    }
    if (best.shade >= kLeastShade && best.smooth >= kSmooth)
      out.push_back({best.centre, 2 * (best.radius + kRimBeyond * px)});
  }
  return out;
}

}  // namespace veneer::calib
