#include "calib/scanner_model.h"

#include <cmath>
#include <utility>

#include "calib/spline_weights.h"

namespace veneer::calib {
ScannerModel::ScannerModel(ScannerModelData data) : data_(std::move(data)) {}

Point<GlassFrame> ScannerModel::glass_from_scan(const Point<ScanFrame>& p, ScanResolution nominal) const {
  const double x = nominal.to_mm(p.x).count(), y = nominal.to_mm(p.y).count();
  if (data_.shift_x_mm.empty()) return point<GlassFrame>(x, -y);
  const SplineWeights across = spline_weights(x, data_.spacing_x_mm, data_.columns);
  const SplineWeights down = spline_weights(y, data_.spacing_y_mm, data_.rows);
  double dx = 0, dy = 0;
  for (int r = 0; r < 4; ++r) {
    const int first = (down.first + r) * data_.columns + across.first;
    const auto start = static_cast<std::size_t>(first);
    for (std::size_t c = 0; c < 4; ++c) {
      const double w = down.w[static_cast<std::size_t>(r)] * across.w[c];
      dx += w * data_.shift_x_mm[start + c];
      dy += w * data_.shift_y_mm[start + c];
    }
  }
  return point<GlassFrame>(x + dx, -y + dy);
}

Point<ScanFrame> ScannerModel::scan_from_glass(const Point<GlassFrame>& p, ScanResolution nominal) const {
  // The map is the identity but for a few thousandths, so each step wins two digits or more.
  double x = p.x.count(), y = -p.y.count();
  for (int step = 0; step < 8; ++step) {
    const Point<GlassFrame> at =
        glass_from_scan({nominal.to_px(Millimetres(x)), nominal.to_px(Millimetres(y))}, nominal);
    const double ex = (p.x - at.x).count(), ey = (p.y - at.y).count();
    x += ex, y -= ey;
    if (std::abs(ex) + std::abs(ey) < 1e-10) break;
  }
  return {nominal.to_px(Millimetres(x)), nominal.to_px(Millimetres(y))};
}

GridScan grid_scan(const cv::Mat& picture, ScanResolution nominal, const AprilGrid& grid) {
  GridScan scan{{}, nominal, picture.cols, picture.rows};
  const double cell_px = nominal.to_px(grid.tag_size).count() / 8;
  for (const Tag<ScanFrame>& tag : detect_tags<ScanFrame>(picture, {.decimate = cell_px > 14 ? 4.0 : 2.0}))
    if (grid.has(tag.id)) scan.tags.push_back(tag);
  return scan;
}

}  // namespace veneer::calib
