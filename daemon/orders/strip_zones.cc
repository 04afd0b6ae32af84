#include "daemon/orders/strip_zones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace veneer::daemon {
namespace {

using PanelRegion = Region<PanelFrame>;

// What a strip's wood is before others have theirs.
struct Strip {
  const calib::Zone* zone = nullptr;
  PanelRegion wood;
  Millimetres tolerance{0};
};

// The box around the wood of each label, in one look at the picture; of a label that is not there an empty one.
std::array<cv::Rect, 256> boxes_of(const cv::Mat& labels) {
  std::array<cv::Rect, 256> out;
  for (int row = 0; row < labels.rows; ++row) {
    const auto* pixels = labels.ptr<std::uint8_t>(row);
    for (int from = 0, to = 0; from < labels.cols; from = to) {
      while (to < labels.cols && pixels[to] == pixels[from]) ++to;
      if (pixels[from] != 0) out[pixels[from]] |= cv::Rect(from, row, to - from, 1);
    }
  }
  return out;
}

// The outer borders of all parts and, the other way round, those of large holes, in pixels' middles.
std::vector<std::vector<cv::Point>> borders_of(const cv::Mat& wood, const cv::Point& corner, double smallest_hole_px) {
  std::vector<std::vector<cv::Point>> all, out;
  std::vector<cv::Vec4i> tree;  // next, before, first within, around
  cv::findContours(wood, all, tree, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE, corner);
  for (std::size_t i = 0; i < all.size(); ++i)
    if (tree[i][3] < 0 || cv::contourArea(all[i]) >= smallest_hole_px) out.push_back(std::move(all[i]));
  return out;
}

MicroRing to_micro(const std::vector<cv::Point>& corners, const Raster<PanelFrame>& raster) {
  MicroRing out;
  out.reserve(corners.size());
  for (const cv::Point& corner : corners) {
    const auto p = raster.from_pixels(corner.x + 0.5, corner.y + 0.5);
    out.push_back({std::llround(p.x.count() * 1000), std::llround(p.y.count() * 1000)});
  }
  return out;
}

// What the rings go round in one direction more often than in the other. Sides that were simplified may cross, and a
// part may lie within a hole that is not among the rings: neither cancels wood, as it would by the even-odd rule.
PanelRegion wound(MicroArea rings) {
  const MicroArea there = micro::unite(std::vector{rings});
  for (MicroRing& ring : rings.rings) std::reverse(ring.begin(), ring.end());
  return PanelRegion(micro::unite(there, micro::unite(std::vector{std::move(rings)})));
}

// All of the wood, and at most twice the tolerance and a pixel more.
Strip simplified(const std::vector<std::vector<cv::Point>>& borders, const Raster<PanelFrame>& raster) {
  constexpr Millimetres kTolerance(0.1);
  const double px_per_mm = raster.resolution.px_per_mm;
  for (Millimetres tolerance = kTolerance;; tolerance = tolerance * 2) {
    MicroArea area;
    for (const auto& border : borders) {
      std::vector<cv::Point> corners;
      cv::approxPolyDP(border, corners, tolerance.count() * px_per_mm, true);
      if (corners.size() >= 3) area.rings.push_back(to_micro(corners, raster));
    }
    PanelRegion out = offset(wound(std::move(area)), tolerance + Millimetres(0.5 / px_per_mm));
    if (micro::corners_of(out.micro_area()) <= kMostZoneCorners / 2) return {nullptr, std::move(out), tolerance};
  }
}

PanelRegion without(const PanelRegion& region, const PanelRegion& other) {
  return micro::boxes_overlap(region.micro_area(), other.micro_area()) ? subtract(region, other) : region;
}

// Those that are told finely first: an outline that is told coarsely reaches far, and would take their wood.
void part(std::vector<Strip>& strips) {
  std::vector<Strip*> order;
  order.reserve(strips.size());
  for (Strip& strip : strips) order.push_back(&strip);
  std::ranges::stable_sort(order, {}, [](const Strip* strip) { return strip->tolerance; });
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) order[i]->wood = without(order[i]->wood, order[k]->wood);
  std::erase_if(strips, [](const Strip& strip) { return strip.wood.empty(); });
}

// With cracks and small notches: they are as wide as this at most.
PanelRegion closed(const PanelRegion& wood) {
  constexpr Millimetres kCrack(3);
  return offset(offset(wood, kCrack / 2), kCrack / -2);
}

PanelRegion sheet_of(const Raster<PanelFrame>& map) {
  const auto low = map.origin;
  const Point<PanelFrame> high{low.x + map.width(), low.y + map.height()};
  return PanelRegion(Ring<PanelFrame>{low, {high.x, low.y}, high, {low.x, high.y}});
}

// Without what is so thin that rounding and simplified sides made it.
PanelRegion without_slivers(const PanelRegion& region) {
  constexpr double kLeast = 1;  // mm2
  MicroArea out;
  for (const MicroRing& ring : region.micro_area().rings)
    if (std::abs(micro::area_um2(MicroArea{{ring}})) * 1e-6 >= kLeast) out.rings.push_back(ring);
  return PanelRegion(std::move(out));
}

}  // namespace

std::vector<db::ZoneRecord> zones_of(const calib::VeneerMask& mask) {
  const Raster<PanelFrame>& labels = mask.zones;
  const double px2 = labels.resolution.px_per_mm * labels.resolution.px_per_mm;
  const double smallest_hole_px = calib::MaskOptions{}.smallest_zone.count() * px2;
  const PanelRegion sheet = sheet_of(labels);
  const auto boxes = boxes_of(labels.pixels);
  std::vector<Strip> strips;
  for (const calib::Zone& zone : mask.list) {
    const cv::Rect& box = boxes[static_cast<std::uint8_t>(zone.label)];
    if (box.empty()) continue;
    const auto borders = borders_of(labels.pixels(box) == zone.label, box.tl(), smallest_hole_px);
    Strip& strip = strips.emplace_back(simplified(borders, labels));
    strip.zone = &zone, strip.wood = intersect(strip.wood, sheet);
  }
  part(strips);
  std::vector<db::ZoneRecord> out;
  for (std::size_t i = 0; i < strips.size(); ++i) {
    PanelRegion shape = closed(strips[i].wood);
    for (std::size_t k = 0; k < strips.size(); ++k)
      if (k != i) shape = without(shape, k < i ? out[k].shape : strips[k].wood);
    db::ZoneRecord& record = out.emplace_back();
    record.number = strips[i].zone->label, record.shape = without_slivers(shape);
    record.confidence = std::clamp(strips[i].zone->confidence, 0.0, 1.0);
  }
  return out;
}

}  // namespace veneer::daemon
