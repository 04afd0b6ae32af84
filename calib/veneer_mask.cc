#include "calib/veneer_mask.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/screw_finder.h"
#include "calib/wood_colour.h"

namespace veneer::calib {
namespace {

// What has the colour of wood. Pores and dust are closed, threads of colour opened.
cv::Mat wood_mask(const WorkMap& work, const cv::Mat& fiducials) {
  cv::Mat wood = WoodColour::learn(work, fiducials).wood(work.bgr);
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
std::vector<Zone> label_zones(cv::Mat& usable, cv::Mat& zones, const WorkMap& work, const Raster<PanelFrame>& map,
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

// 255 where all map pixels of a work pixel are set.
cv::Mat all_set(const cv::Mat& mask, const WorkMap& work) {
  cv::Mat lowest, padded;
  cv::copyMakeBorder(mask, padded, 0, work.bgr.rows * work.fold - mask.rows, 0, work.bgr.cols * work.fold - mask.cols,
                     cv::BORDER_REPLICATE);
  cv::resize(padded, lowest, work.bgr.size(), 0, 0, cv::INTER_AREA);
  return lowest == 255;
}

Raster<PanelFrame> grow(const cv::Mat& small, int fold, const Raster<PanelFrame>& map) {
  cv::Mat grown;
  cv::resize(small, grown, {}, fold, fold, cv::INTER_NEAREST);
  return {grown(cv::Rect(0, 0, map.pixels.cols, map.pixels.rows)).clone(), map.resolution, map.origin};
}

}  // namespace

Result<VeneerMask> mask_veneer(const Raster<PanelFrame>& map, const PanelFiducials& fiducials,
                               const MaskOptions& options, const Raster<PanelFrame>* earlier) {
  if (map.pixels.type() != CV_8UC3 || map.pixels.empty())
    return Error{ErrorCode::kInvalidArgument, "the veneer map to mask is empty or not an 8 bit colour picture"};
  if (earlier != nullptr && (earlier->pixels.type() != CV_8UC1 || earlier->pixels.size() != map.pixels.size()))
    return Error{ErrorCode::kInvalidArgument, "the earlier mask is not as large as the veneer map"};
  const WorkMap work = shrink(map);
  const cv::Mat marked = mark_fiducials(map, fiducials, work, options.fiducial_margin);
  cv::Mat wood = wood_mask(work, marked);
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
  if (earlier != nullptr) cv::bitwise_and(usable, all_set(earlier->pixels, work), usable);
  out.list = label_zones(usable, zones, work, map, options);
  if (out.list.empty())
    return Error{ErrorCode::kRefused, "no veneer is seen on the map: check that the show face was scanned"};
  out.zones = grow(zones, work.fold, map);
  // A picture of its own: assigned to a copy that shares its pixels, the comparison would overwrite the labels.
  out.usable = {out.zones.pixels > 0, out.zones.resolution, out.zones.origin};
  return out;
}

}  // namespace veneer::calib
