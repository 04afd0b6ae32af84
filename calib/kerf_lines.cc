#include "calib/kerf_lines.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/constellation.h"

namespace veneer::calib {
namespace {

constexpr double kThinMm = 1.1;  // wider than a slit with its rims
constexpr double kLengthTolerance = 0.15;

// How strongly a pixel stands out of its surroundings as a thin bright or thin dark thing, in any colour.
cv::Mat thin_things(const cv::Mat& scan, ScanResolution resolution) {
  const int size = static_cast<int>(std::lround(resolution.to_px(Millimetres(kThinMm)).count())) | 1;
  const cv::Mat kernel = cv::getStructuringElement(cv::MORPH_RECT, {size, size});
  std::vector<cv::Mat> channels;
  cv::split(scan, channels);
  cv::Mat out = cv::Mat::zeros(scan.size(), CV_8UC1), thin;
  for (const cv::Mat& channel : channels) {
    cv::morphologyEx(channel, thin, cv::MORPH_TOPHAT, kernel);
    cv::max(out, thin, out);
    cv::morphologyEx(channel, thin, cv::MORPH_BLACKHAT, kernel);
    cv::max(out, thin, out);
  }
  return out;
}

struct Segment {
  Point<SlitFrame> a, b;
};

std::vector<Segment> straight_segments(const cv::Mat& thin, double threshold, ScanResolution resolution,
                                       Millimetres shortest, Millimetres longest) {
  std::vector<std::vector<cv::Point>> contours;
  cv::Mat strong = thin > threshold;
  cv::morphologyEx(strong, strong, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  cv::findContours(strong, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<Segment> out;
  for (const auto& contour : contours) {
    if (contour.size() < 20) continue;
    const cv::RotatedRect box = cv::minAreaRect(contour);
    const double length = std::max(box.size.width, box.size.height), width = std::min(box.size.width, box.size.height);
    const Millimetres length_mm = resolution.to_mm(Pixels(length)), width_mm = resolution.to_mm(Pixels(width));
    if (length_mm < shortest || length_mm > longest || width_mm > Millimetres(1.6)) continue;
    const double turn = (box.size.width >= box.size.height ? box.angle : box.angle + 90) * kPi / 180;
    const auto end = [&](double way) {
      // findContours counts a pixel's centre as 0.
      const double x = box.center.x + 0.5 + way * length / 2 * std::cos(turn);
      const double y = box.center.y + 0.5 + way * length / 2 * std::sin(turn);
      return Point<SlitFrame>{resolution.to_mm(Pixels(x)), -resolution.to_mm(Pixels(y))};
    };
    out.push_back({end(-1), end(1)});
  }
  return out;
}

// The known line nearest to a seen segment under the match: both ends must be near.
std::vector<FoundLine> assign(const std::vector<Segment>& segments, std::span<const KerfLine> lines,
                              const Isometry2<SlitFrame, MachineFrame>& slit_from_machine) {
  std::vector<FoundLine> out;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto from = slit_from_machine * lines[i].from, to = slit_from_machine * lines[i].to;
    double best = 1.5;  // mm, of both ends
    std::optional<FoundLine> found;
    for (const Segment& s : segments) {
      const double same = std::max(distance(s.a, from).count(), distance(s.b, to).count());
      const double other = std::max(distance(s.b, from).count(), distance(s.a, to).count());
      if (std::min(same, other) >= best) continue;
      best = std::min(same, other);
      found = same < other ? FoundLine{i, s.a, s.b} : FoundLine{i, s.b, s.a};
    }
    if (found) out.push_back(*found);
  }
  return out;
}

}  // namespace

std::vector<FoundLine> find_kerf_lines(const cv::Mat& scan, ScanResolution resolution, std::span<const KerfLine> lines,
                                       double min_found) {
  Millimetres shortest(1e9), longest(0);
  std::vector<ConstellationPoint<MachineFrame>> known;
  for (const auto& line : lines) {
    shortest = std::min(shortest, distance(line.from, line.to)),
    longest = std::max(longest, distance(line.from, line.to));
    known.push_back({line.from, 0}), known.push_back({line.to, 0});
  }
  const cv::Mat thin = thin_things(scan, resolution);
  for (const double threshold : {60.0, 42.0, 30.0, 20.0}) {
    const auto segments = straight_segments(thin, threshold, resolution, shortest * (1 - kLengthTolerance),
                                            longest * (1 + kLengthTolerance));
    if (segments.size() > 400) break;  // grain, not lines
    std::vector<ConstellationPoint<SlitFrame>> seen;
    for (const Segment& s : segments) seen.push_back({s.a, 0}), seen.push_back({s.b, 0});
    const auto match = match_constellation<SlitFrame, MachineFrame>(
        seen, known, {.scale_tolerance = 0.012, .tolerance = Millimetres(1.2), .may_be_mirrored = true});
    if (!match) continue;
    auto found = assign(segments, lines, match->seen_from_known);
    if (static_cast<double>(found.size()) >= min_found * static_cast<double>(lines.size())) return found;
  }
  return {};
}

}  // namespace veneer::calib
