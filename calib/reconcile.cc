#include "calib/reconcile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "calib/change_of_light.h"
#include "calib/unchanged_look.h"
#include "calib/wood_change.h"
#include "calib/work_map.h"

namespace veneer::calib {
namespace {

constexpr Millimetres kSooted(1);      // beside a cut
constexpr Millimetres kSheetRim(0.5);  // of the sheet, whose edge lies a little elsewhere in each map
// mm2 of a place times the median of its pixels' chi squared, at most 255 each: the smaller a place is, the more it has
// to differ. 191 losses above 3 mm2 made 1350 and more, what light leaves over on pale woods up to 75.
constexpr double kLeastEvidence = 300;

void mark_rim(cv::Mat& mask, double width_px) {
  cv::rectangle(mask, {0, 0}, {mask.cols - 1, mask.rows - 1}, cv::Scalar(255), 2 * cvRound(width_px) + 1);
}

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

cv::Mat on_work_map(const cv::Mat& mask, const WorkMap& work) {
  cv::Mat out;
  const int right = work.bgr.cols * work.fold - mask.cols, below = work.bgr.rows * work.fold - mask.rows;
  cv::copyMakeBorder(mask, out, 0, below, 0, right, cv::BORDER_REPLICATE);
  cv::resize(out, out, work.bgr.size(), 0, 0, cv::INTER_AREA);
  return out >= 128;
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

std::uint8_t median_within(const cv::Mat& values, const cv::Mat& where) {
  std::array<int, 256> counts{};
  for (int r = 0; r < values.rows; ++r)
    for (int c = 0; c < values.cols; ++c)
      if (where.at<std::uint8_t>(r, c) != 0) ++counts[values.at<std::uint8_t>(r, c)];
  const int half = cv::countNonZero(where) / 2;
  std::uint8_t value = 0;
  for (int below = counts[0]; below <= half && value < 255; below += counts[value]) ++value;
  return value;
}

// The parts of `mask` that are wide and large enough, and unlike enough to what was there, to be told to the operator.
void collect(cv::Mat mask, const cv::Mat& unlikeness, DifferenceKind kind, const Raster<PanelFrame>& map,
             const WorkMap& work, const ReconcileOptions& options, std::vector<Difference>& out) {
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
    if (!unlikeness.empty() && difference.area.count() * median_within(unlikeness(box), part) < kLeastEvidence)
      continue;
    cv::minMaxLoc(depth(box), nullptr, nullptr, nullptr, &deepest, part);
    difference.place = map.from_pixels((box.x + deepest.x + 0.5) * work.fold, (box.y + deepest.y + 0.5) * work.fold);
    difference.shape = shape_of(part, box.tl(), map, work);
    out.push_back(std::move(difference));
  }
}

// Parts of a sheet that are judged each by itself, so that a large one takes no more memory than a small one: what lies
// within `inner` is judged, with what is seen around it.
struct Tile {
  cv::Rect inner, whole;
};
std::vector<Tile> tiles_of(const cv::Size& size, double px_per_mm) {
  constexpr int kMost = 2000;     // pixels of the work map a side, 340 mm
  constexpr double kAround = 12;  // mm, farther than windows and smoke reach
  const int columns = (size.width + kMost - 1) / kMost, rows = (size.height + kMost - 1) / kMost,
            around = cvRound(kAround * px_per_mm);
  std::vector<Tile> out;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const cv::Point from(size.width * c / columns, size.height * r / rows),
          to(size.width * (c + 1) / columns, size.height * (r + 1) / rows);
      const cv::Point more(around, around);
      out.push_back({cv::Rect(from, to), cv::Rect(from - more, to + more) & cv::Rect({}, size)});
    }
  return out;
}

}  // namespace

Result<Reconciliation> reconcile(const Raster<PanelFrame>& before, const Raster<PanelFrame>& now,
                                 const std::vector<Region<PanelFrame>>& booked_gone, const PanelFiducials& fiducials,
                                 const ReconcileOptions& options, const Raster<PanelFrame>* wood) {
  for (const auto* map : {&before, &now})
    if (map->pixels.type() != CV_8UC3 || map->pixels.empty())
      return Error{ErrorCode::kInvalidArgument,
                   "a veneer map to compare is empty or not an 8 bit colour picture: scan the panel again"};
  if (before.pixels.size() != now.pixels.size() || distance(before.origin, now.origin) > Millimetres(1e-3) ||
      std::abs(before.resolution.px_per_mm - now.resolution.px_per_mm) > 1e-6)
    return Error{ErrorCode::kInvalidArgument,
                 "the two veneer maps to compare do not cover the same area: scan the panel again"};

  if (wood != nullptr && (wood->pixels.type() != CV_8UC1 || wood->pixels.size() != now.pixels.size()))
    return Error{ErrorCode::kInvalidArgument,
                 "the mask of the wood is not as large as the veneer maps to compare: scan the panel again"};

  const WorkMap old_work = shrink(before), work = shrink(now);
  cv::Mat marked = mark_fiducials(now, fiducials, work, Millimetres(1));
  mark_rim(marked, kSheetRim.count() * work.px_per_mm);
  const auto booked = [&](Millimetres moved) { return draw(moved_borders(booked_gone, moved), now, work); };
  const cv::Mat touched = booked(kSooted) | draw(moved_borders(options.uncertain, kSooted), now, work);
  const cv::Mat cut = booked(Millimetres(0)), well_inside = booked(-options.tolerance);
  const cv::Mat believed =
      wood != nullptr ? on_work_map(wood->pixels, work) : cv::Mat(cut.size(), CV_8UC1, cv::Scalar(255));
  Reconciliation out;
  const ChangeOfLight light = learn_change_of_light(old_work.bgr, work.bgr, touched, work.px_per_mm);
  out.light_known = light.known;
  cv::Mat lost(cut.size(), CV_8UC1), unlikeness(cut.size(), CV_8UC1), was_open(cut.size(), CV_8UC1);
  for (const Tile& tile : tiles_of(cut.size(), work.px_per_mm)) {
    const cv::Rect& all = tile.whole;
    const cv::Rect inner(tile.inner.tl() - all.tl(), tile.inner.size());
    const UnchangedLook look =
        look_unchanged(old_work.bgr(all), work.bgr(all), touched(all), work.px_per_mm, light, all.tl());
    const WoodChange here = find_changes(look, work.bgr(all), cut(all), marked(all), work.px_per_mm);
    here.gone(inner).copyTo(lost(tile.inner));
    here.unlikeness(inner).copyTo(unlikeness(tile.inner));
    find_earlier_openings(old_work.bgr(all), well_inside(all) & ~here.gone, believed(all) & ~here.gone,
                          work.px_per_mm)(inner)
        .copyTo(was_open(tile.inner));
  }

  cv::Mat not_booked = lost & ~booked(options.tolerance);
  cv::Mat still_there = well_inside & ~lost & ~was_open;
  not_booked &= believed;
  not_booked.setTo(0, marked);
  still_there.setTo(0, marked);

  collect(not_booked, unlikeness, DifferenceKind::kGoneNotBooked, now, work, options, out.differences);
  collect(still_there, {}, DifferenceKind::kBookedNotGone, now, work, options, out.differences);
  std::stable_sort(out.differences.begin(), out.differences.end(),
                   [](const Difference& a, const Difference& b) { return a.area > b.area; });

  cv::Mat gone = lost | was_open;
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
