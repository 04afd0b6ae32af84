#include "calib/veneer_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/probe.h"
#include "calib/screw_finder.h"

namespace veneer::calib {
namespace {

constexpr double kWorkPxPerMm = 6;
constexpr double kWarmer = 0.09;   // log(red / blue) by which wood exceeds board and lid
constexpr double kBlack = 4;       // grey levels added before a ratio is formed: the scanner's own black
constexpr double kOutermost = 12;  // mm of margin from which the board is learnt

double warmth(const cv::Vec3b& bgr) { return std::log((bgr[2] + kBlack) / (bgr[0] + kBlack)); }

cv::Mat round_kernel(double radius_px) {
  const int half = std::max(1, static_cast<int>(std::lround(radius_px)));
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * half + 1, 2 * half + 1});
}

double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The map at working resolution, `fold` map pixels to one. A map that does not divide is continued at its right and
// lower borders, so that the small picture's pixel (c, r) covers the map's pixels from (c * fold, r * fold).
struct Work {
  int fold = 1;
  double px_per_mm = 0;
  cv::Mat bgr;
};

Work shrink(const Raster<PanelFrame>& map) {
  Work work;
  work.fold = std::max(1, static_cast<int>(std::lround(map.resolution.px_per_mm / kWorkPxPerMm)));
  work.px_per_mm = map.resolution.px_per_mm / work.fold;
  const int right = (work.fold - map.pixels.cols % work.fold) % work.fold;
  const int below = (work.fold - map.pixels.rows % work.fold) % work.fold;
  cv::Mat padded;
  cv::copyMakeBorder(map.pixels, padded, 0, below, 0, right, cv::BORDER_REPLICATE);
  cv::resize(padded, work.bgr, {padded.cols / work.fold, padded.rows / work.fold}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(work.bgr, work.bgr, {}, 0.15 * work.px_per_mm);
  return work;
}

// 255 on tags, through-holes and what lies close to them.
cv::Mat fiducial_mask(const Raster<PanelFrame>& map, const PanelFiducials& fiducials, const Work& work,
                      const MaskOptions& options) {
  cv::Mat mask = cv::Mat::zeros(work.bgr.size(), CV_8UC1);
  const auto at = [&](const Point<PanelFrame>& p) {
    double c = 0, r = 0;
    map.to_pixels(p, c, r);
    return cv::Point2d(c / work.fold, r / work.fold);
  };
  for (const PanelTag& tag : fiducials.tags) {
    if (tag.face != Face::kShow) continue;
    std::vector<cv::Point2d> corners;
    cv::Point2d middle(0, 0);
    for (const auto& corner : tag.corners) corners.push_back(at(corner)), middle += corners.back() / 4.0;
    std::vector<cv::Point> grown;
    for (const auto& corner : corners) {
      // A quiet zone of one cell (an eighth of the side), and the margin.
      const cv::Point2d out = corner - middle;
      const double reach = std::hypot(out.x, out.y);
      const double more = reach * 0.25 + options.fiducial_margin.count() * work.px_per_mm * 1.414;
      grown.emplace_back(middle + out * ((reach + more) / reach));
    }
    cv::fillConvexPoly(mask, grown, cv::Scalar(255));
  }
  for (const PanelHole& hole : fiducials.holes)
    cv::circle(mask, at(hole.centre),
               static_cast<int>((hole.diameter / 2 + options.fiducial_margin).count() * work.px_per_mm) + 1,
               cv::Scalar(255), cv::FILLED);
  return mask;
}

// log(red / blue) that separates wood from board and lid: above the warmer of the two, both taken from the map itself.
double warmth_threshold(const Work& work, const cv::Mat& fiducials) {
  const int margin = static_cast<int>(kOutermost * work.px_per_mm), skip = static_cast<int>(1.5 * work.px_per_mm);
  const cv::Mat darkest = darkest_channel(work.bgr);
  const double white = top_level(darkest, 0.003);
  std::vector<double> board, lid;
  for (int r = 0; r < work.bgr.rows; r += 3)
    for (int c = 0; c < work.bgr.cols; c += 3) {
      const auto& pixel = work.bgr.at<cv::Vec3b>(r, c);
      const int low = darkest.at<std::uint8_t>(r, c), high = std::max({pixel[0], pixel[1], pixel[2]});
      if (low >= 0.92 * white) lid.push_back(warmth(pixel));
      const int rim = std::min({r, c, work.bgr.rows - 1 - r, work.bgr.cols - 1 - c});
      // Of the margin what is neutral: strips may reach into it on another panel.
      if (rim > skip && rim < margin && fiducials.at<std::uint8_t>(r, c) == 0 && low < 0.85 * white && low > 0.8 * high)
        board.push_back(warmth(pixel));
    }
  return std::max(board.size() > 100 ? median(board) : 0.0, lid.size() > 100 ? median(lid) : 0.0) + kWarmer;
}

// What has the warm colour of wood. Pores and dust are closed, threads of colour opened.
cv::Mat warm_mask(const Work& work, double threshold) {
  cv::Mat wood(work.bgr.size(), CV_8UC1);
  const double ratio = std::exp(threshold);
  const cv::Mat darkest = darkest_channel(work.bgr);
  const double white = top_level(darkest, 0.003);
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c) {
      const auto& pixel = work.bgr.at<cv::Vec3b>(r, c);
      const bool lid = darkest.at<std::uint8_t>(r, c) > 0.93 * white;
      wood.at<std::uint8_t>(r, c) = !lid && pixel[2] + kBlack > ratio * (pixel[0] + kBlack) ? 255 : 0;
    }
  cv::morphologyEx(wood, wood, cv::MORPH_CLOSE, round_kernel(0.2 * work.px_per_mm));
  cv::morphologyEx(wood, wood, cv::MORPH_OPEN, round_kernel(1.0 * work.px_per_mm));
  return wood;
}

// Holes in the wood that are too small to be anything but a speck on the glass are wood again.
void fill_specks(cv::Mat& wood, double px_per_mm) {
  cv::Mat labels, stats, centres;
  const cv::Mat bare = wood == 0;
  const int count = cv::connectedComponentsWithStats(bare, labels, stats, centres, 4);
  const double limit = 0.6 * px_per_mm;
  std::vector<bool> speck(static_cast<std::size_t>(count), false);
  for (int i = 1; i < count; ++i)
    speck[static_cast<std::size_t>(i)] =
        std::min(stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT)) < limit &&
        std::max(stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT)) < 3 * limit;
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c)
      if (speck[static_cast<std::size_t>(labels.at<int>(r, c))]) wood.at<std::uint8_t>(r, c) = 255;
}

// Keeps `margin_px` from whatever is not wood; the map's own border counts as such.
cv::Mat keep_away(const cv::Mat& wood, double margin_px) {
  cv::Mat framed, distance;
  cv::copyMakeBorder(wood, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(framed, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat kept = distance > margin_px + 0.5;
  return kept(cv::Rect(1, 1, wood.cols, wood.rows)).clone();
}

// Connected parts, the small ones dropped, numbered from left to right.
std::vector<Zone> label_zones(cv::Mat& usable, cv::Mat& zones, const Work& work, const Raster<PanelFrame>& map,
                              const MaskOptions& options) {
  cv::Mat labels, stats, centres;
  const int count = cv::connectedComponentsWithStats(usable, labels, stats, centres, 4);
  const double px2 = work.px_per_mm * work.px_per_mm;
  std::vector<int> order;
  for (int i = 1; i < count; ++i)
    if (stats.at<int>(i, cv::CC_STAT_AREA) >= options.smallest_zone.count() * px2) order.push_back(i);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return centres.at<double>(a, 0) < centres.at<double>(b, 0); });
  if (order.size() > 255) order.resize(255);
  std::vector<std::uint8_t> number(static_cast<std::size_t>(count), 0);
  std::vector<Zone> list;
  for (const int i : order) {
    Zone zone;
    zone.label = static_cast<int>(list.size()) + 1;
    number[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(zone.label);
    zone.area = SquareMillimetres(stats.at<int>(i, cv::CC_STAT_AREA) / px2);
    const double left = stats.at<int>(i, cv::CC_STAT_LEFT) * work.fold,
                 top = stats.at<int>(i, cv::CC_STAT_TOP) * work.fold;
    zone.box.add(map.from_pixels(left, top));
    zone.box.add(map.from_pixels(left + stats.at<int>(i, cv::CC_STAT_WIDTH) * work.fold,
                                 top + stats.at<int>(i, cv::CC_STAT_HEIGHT) * work.fold));
    list.push_back(zone);
  }
  cv::Mat grey;
  cv::cvtColor(work.bgr, grey, cv::COLOR_BGR2GRAY);
  std::vector<double> sums(list.size(), 0), counts(list.size(), 0);
  zones = cv::Mat::zeros(usable.size(), CV_8UC1);
  for (int r = 0; r < usable.rows; ++r)
    for (int c = 0; c < usable.cols; ++c) {
      const std::uint8_t label = number[static_cast<std::size_t>(labels.at<int>(r, c))];
      zones.at<std::uint8_t>(r, c) = label;
      if (label != 0) sums[label - 1U] += grey.at<std::uint8_t>(r, c), counts[label - 1U] += 1;
    }
  for (std::size_t i = 0; i < list.size(); ++i) list[i].lightness = sums[i] / std::max(1.0, counts[i]);
  return list;
}

Raster<PanelFrame> grow(const cv::Mat& small, int fold, const Raster<PanelFrame>& map) {
  cv::Mat grown;
  cv::resize(small, grown, {}, fold, fold, cv::INTER_NEAREST);
  return {grown(cv::Rect(0, 0, map.pixels.cols, map.pixels.rows)).clone(), map.resolution, map.origin};
}

}  // namespace

Result<VeneerMask> mask_veneer(const Raster<PanelFrame>& map, const PanelFiducials& fiducials,
                               const MaskOptions& options) {
  if (map.pixels.type() != CV_8UC3 || map.pixels.empty())
    return Error{ErrorCode::kInvalidArgument, "the veneer map to mask is empty or not an 8 bit colour picture"};
  const Work work = shrink(map);
  const cv::Mat marked = fiducial_mask(map, fiducials, work, options);
  cv::Mat wood = warm_mask(work, warmth_threshold(work, marked));
  wood.setTo(0, marked);
  fill_specks(wood, work.px_per_mm);

  VeneerMask out;
  for (const ScrewSpot& screw : find_screws(work.bgr, wood, work.px_per_mm, options)) {
    const double radius = screw.diameter / 2 + (options.screw_margin - options.edge_margin).count() * work.px_per_mm;
    cv::circle(wood, cv::Point2d(screw.centre.x - 0.5, screw.centre.y - 0.5), static_cast<int>(std::ceil(radius)),
               cv::Scalar(0), cv::FILLED);
    out.screws.push_back({map.from_pixels(screw.centre.x * work.fold, screw.centre.y * work.fold),
                          Millimetres(screw.diameter / work.px_per_mm)});
  }
  cv::Mat usable = keep_away(wood, options.edge_margin.count() * work.px_per_mm), zones;
  out.list = label_zones(usable, zones, work, map, options);
  if (out.list.empty())
    return Error{ErrorCode::kRefused, "no veneer is seen on the map: check that the show face was scanned"};
  out.zones = grow(zones, work.fold, map);
  out.usable = out.zones;
  out.usable.pixels = out.zones.pixels > 0;
  return out;
}

}  // namespace veneer::calib
