#include "daemon/orders/strip_zones.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace veneer::daemon {
namespace {

using PanelRegion = Region<PanelFrame>;

// Outer borders counter-clockwise and the borders of large holes, in pixels' middles.
std::vector<std::vector<cv::Point>> borders_of(const cv::Mat& wood, double smallest_hole_px) {
  std::vector<std::vector<cv::Point>> all, out;
  std::vector<cv::Vec4i> tree;  // next, before, first within, around
  cv::findContours(wood, all, tree, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
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

// All of the wood and at most twice the tolerance, and a pixel, more. Sides that were simplified may cross: what lies
// within by the even-odd rule is the area.
PanelRegion simplified(const std::vector<std::vector<cv::Point>>& borders, const Raster<PanelFrame>& raster) {
  constexpr Millimetres kTolerance(0.1);
  const double px_per_mm = raster.resolution.px_per_mm;
  for (Millimetres tolerance = kTolerance;; tolerance = tolerance * 2) {
    MicroArea area;
    for (const auto& border : borders) {
      std::vector<cv::Point> corners;
      cv::approxPolyDP(border, corners, tolerance.count() * px_per_mm, true);
      if (corners.size() >= 3) area.rings.push_back(to_micro(corners, raster));
    }
    PanelRegion out = offset(PanelRegion(micro::unite(area, {})), tolerance + Millimetres(0.5 / px_per_mm));
    if (micro::corners_of(out.micro_area()) <= kMostZoneCorners / 2) return out;
  }
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
  std::vector<PanelRegion> woods;  // of the zones before, too
  std::vector<int> numbers;
  std::vector<double> confidences;
  for (const calib::Zone& zone : mask.list) {
    const auto borders = borders_of(labels.pixels == zone.label, smallest_hole_px);
    PanelRegion wood = intersect(simplified(borders, labels), sheet);
    for (const PanelRegion& other : woods) wood = subtract(wood, other);
    if (wood.empty()) continue;
    woods.push_back(std::move(wood)), numbers.push_back(zone.label), confidences.push_back(zone.confidence);
  }
  std::vector<db::ZoneRecord> out;
  for (std::size_t i = 0; i < woods.size(); ++i) {
    PanelRegion shape = closed(woods[i]);
    for (std::size_t k = 0; k < woods.size(); ++k)
      if (k != i) shape = subtract(shape, k < i ? out[k].shape : woods[k]);
    db::ZoneRecord& record = out.emplace_back();
    record.number = numbers[i], record.shape = without_slivers(shape);
    record.confidence = std::clamp(confidences[i], 0.0, 1.0);
  }
  return out;
}

}  // namespace veneer::daemon
