#include "calib/reconcile.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "calib/wood_colour.h"

namespace veneer::calib {
namespace {

constexpr double kLitLid = 0.75;  // of the lid's brightness: what shows through the board is shaded by it

// The region on the work map's pixels.
cv::Mat draw(const Region<PanelFrame>& region, const Raster<PanelFrame>& map, const WorkMap& work) {
  constexpr int kShift = 6;
  cv::Mat mask = cv::Mat::zeros(work.bgr.size(), CV_8UC1);
  std::vector<std::vector<cv::Point>> rings;
  for (const auto& ring : region.rings()) {
    auto& out = rings.emplace_back();
    for (const auto& p : ring) {
      double column = 0, row = 0;
      map.to_pixels(p, column, row);
      // OpenCV's pixel centres are at 0.
      out.emplace_back(static_cast<int>(std::lround((column / work.fold - 0.5) * (1 << kShift))),
                       static_cast<int>(std::lround((row / work.fold - 0.5) * (1 << kShift))));
    }
  }
  if (!rings.empty()) cv::fillPoly(mask, rings, cv::Scalar(255), cv::LINE_8, kShift);
  return mask;
}

// The regions, each with its border moved outwards by a distance (inwards when it is negative).
Region<PanelFrame> moved_borders(const std::vector<Region<PanelFrame>>& regions, Millimetres by) {
  std::vector<Region<PanelFrame>> moved;
  moved.reserve(regions.size());
  for (const auto& region : regions) moved.push_back(offset(region, by));
  return unite(moved);
}

// Neutral and bright, if shaded: the lid behind an opening.
cv::Mat lid_behind(const WorkMap& work, const WoodColour& colour) {
  cv::Mat mask(work.bgr.size(), CV_8UC1);
  for (int r = 0; r < mask.rows; ++r)
    for (int c = 0; c < mask.cols; ++c) {
      const auto& pixel = work.bgr.at<cv::Vec3b>(r, c);
      const bool bright = std::min({pixel[0], pixel[1], pixel[2]}) > kLitLid * colour.white;
      mask.at<std::uint8_t>(r, c) = bright && !colour.is_wood(pixel) ? 255 : 0;
    }
  return mask;
}

// The pixels of one part: the outline of their centres, half a pixel wider.
Region<PanelFrame> shape_of(const cv::Mat& part, const cv::Point& at, const Raster<PanelFrame>& map,
                            const WorkMap& work) {
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(part, outlines, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE, at);
  MicroArea centres;
  for (const auto& outline : outlines) {
    MicroRing& ring = centres.rings.emplace_back();
    for (const cv::Point& pixel : outline) {
      const auto p = map.from_pixels((pixel.x + 0.5) * work.fold, (pixel.y + 0.5) * work.fold);
      ring.push_back({std::llround(p.x.count() * 1000), std::llround(p.y.count() * 1000)});
    }
  }
  return offset(Region<PanelFrame>(micro::unite(centres, {})), Millimetres(0.5 / work.px_per_mm));
}

// The parts of `mask` that are wide and large enough to be told to the operator.
void collect(cv::Mat mask, DifferenceKind kind, const Raster<PanelFrame>& map, const WorkMap& work,
             const ReconcileOptions& options, std::vector<Difference>& out) {
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, round_kernel(options.narrowest.count() / 2 * work.px_per_mm));
  cv::Mat labels, stats, centres, depth;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centres, 8);
  cv::distanceTransform(mask, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const double px2 = work.px_per_mm * work.px_per_mm;
  for (int i = 1; i < count; ++i) {
    Difference difference;
    difference.kind = kind;
    difference.area = SquareMillimetres(stats.at<int>(i, cv::CC_STAT_AREA) / px2);
    if (difference.area < options.smallest) continue;
    const cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                       stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
    cv::Point deepest;
    const cv::Mat part = labels(box) == i;
    cv::minMaxLoc(depth(box), nullptr, nullptr, nullptr, &deepest, part);
    difference.place = map.from_pixels((box.x + deepest.x + 0.5) * work.fold, (box.y + deepest.y + 0.5) * work.fold);
    difference.shape = shape_of(part, box.tl(), map, work);
    out.push_back(std::move(difference));
  }
}

}  // namespace

Result<Reconciliation> reconcile(const Raster<PanelFrame>& before, const Raster<PanelFrame>& now,
                                 const std::vector<Region<PanelFrame>>& booked_gone, const PanelFiducials& fiducials,
                                 const ReconcileOptions& options) {
  for (const auto* map : {&before, &now})
    if (map->pixels.type() != CV_8UC3 || map->pixels.empty())
      return Error{ErrorCode::kInvalidArgument, "a veneer map to compare is empty or not an 8 bit colour picture"};
  if (before.pixels.size() != now.pixels.size() || distance(before.origin, now.origin) > Millimetres(1e-3) ||
      std::abs(before.resolution.px_per_mm - now.resolution.px_per_mm) > 1e-6)
    return Error{ErrorCode::kInvalidArgument, "the two veneer maps to compare do not cover the same area"};

  const WorkMap old_work = shrink(before), work = shrink(now);
  const cv::Mat marked = mark_fiducials(now, fiducials, work, Millimetres(1));
  const WoodColour old_colour = WoodColour::learn(old_work, marked), colour = WoodColour::learn(work, marked);
  const cv::Mat was_wood = old_colour.wood(old_work.bgr), is_wood = colour.wood(work.bgr);
  const cv::Mat was_open = lid_behind(old_work, old_colour), is_open = lid_behind(work, colour);
  const auto booked = [&](Millimetres moved) { return draw(moved_borders(booked_gone, moved), now, work); };

  // Wood that lost its colour is gone, lit or in the shadow of the rim; what was no wood is gone where the lid is seen.
  cv::Mat lost = (was_wood & ~is_wood) | (is_open & ~was_open);
  cv::Mat not_booked = lost & ~booked(options.tolerance);
  cv::Mat still_there = is_wood & booked(-options.tolerance);
  not_booked.setTo(0, marked);
  still_there.setTo(0, marked);

  Reconciliation out;
  collect(not_booked, DifferenceKind::kGoneNotBooked, now, work, options, out.differences);
  collect(still_there, DifferenceKind::kBookedNotGone, now, work, options, out.differences);
  std::stable_sort(out.differences.begin(), out.differences.end(),
                   [](const Difference& a, const Difference& b) { return a.area > b.area; });

  cv::Mat gone = lost | is_open | (booked(Millimetres(0)) & ~is_wood);
  gone.setTo(0, marked);
  cv::morphologyEx(gone, gone, cv::MORPH_OPEN, round_kernel(options.narrowest.count() / 2 * work.px_per_mm));
  out.gone = SquareMillimetres(cv::countNonZero(gone) / (work.px_per_mm * work.px_per_mm));
  // The work map may reach beyond the map's lower border by less than a pixel of its own.
  out.gone_mask.pixels = gone;
  out.gone_mask.resolution = {work.px_per_mm};
  out.gone_mask.origin = now.from_pixels(0, gone.rows * work.fold);
  return out;
}

double share_gone(const Raster<PanelFrame>& gone_mask, const Region<PanelFrame>& outline, Millimetres margin) {
  constexpr int kShift = 6;
  std::vector<std::vector<cv::Point2d>> rings;  // in continuous pixels
  std::vector<cv::Point> corners;
  for (const auto& ring : offset(outline, -margin).rings()) {
    auto& out = rings.emplace_back();
    for (const auto& p : ring) {
      cv::Point2d& pixel = out.emplace_back();
      gone_mask.to_pixels(p, pixel.x, pixel.y);
      corners.emplace_back(cvFloor(pixel.x), cvFloor(pixel.y));
    }
  }
  if (rings.empty()) return 0;
  const cv::Rect box = cv::boundingRect(corners) & cv::Rect({}, gone_mask.pixels.size());
  if (box.empty()) return 0;
  std::vector<std::vector<cv::Point>> in_box;
  for (const auto& ring : rings) {
    auto& out = in_box.emplace_back();
    // OpenCV's pixel centres are at 0.
    for (const auto& pixel : ring)
      out.emplace_back(cvRound((pixel.x - box.x - 0.5) * (1 << kShift)),
                       cvRound((pixel.y - box.y - 0.5) * (1 << kShift)));
  }
  cv::Mat inside = cv::Mat::zeros(box.size(), CV_8UC1);
  cv::fillPoly(inside, in_box, cv::Scalar(255), cv::LINE_8, kShift);
  const int all = cv::countNonZero(inside);
  return all == 0 ? 0 : static_cast<double>(cv::countNonZero(inside & gone_mask.pixels(box))) / all;
}

}  // namespace veneer::calib
