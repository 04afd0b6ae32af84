// Maps of a rendered sheet before and after wood was taken from it, for tests of reconciliation.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "calib/reconcile.h"
#include "tests/support/rendered_panel.h"

namespace veneer::reconciled {

using Outline = std::vector<cv::Point2d>;

inline std::vector<Region<PanelFrame>> regions_of(const std::vector<Outline>& outlines) {
  std::vector<Region<PanelFrame>> all;
  for (const auto& outline : outlines) {
    Ring<PanelFrame> ring;
    for (const auto& p : outline) ring.push_back(point<PanelFrame>(p.x, p.y));
    all.emplace_back(ring);
  }
  return all;
}
inline Region<PanelFrame> region_of(const Outline& outline) { return regions_of({outline}).front(); }

// For a failed test: what was told, and where.
inline std::string told(const std::vector<calib::Difference>& differences) {
  std::ostringstream out;
  for (const calib::Difference& d : differences)
    out << to_string(d.kind) << ' ' << d.area.count() << " mm2 at " << d.place.x.count() << ", " << d.place.y.count()
        << '\n';
  return out.str();
}

struct Shelf {
  rendered::Panel panel = rendered::sample_panel(140, 104, 8);
  calib::PanelFiducials fiducials;
  double noise = 1.5;  // grey levels

  Shelf() {
    for (const auto& tag : panel.tags) fiducials.tags.push_back({tag.id, tag.face, tag.corners()});
    for (const auto& hole : panel.holes)
      fiducials.holes.push_back({point<PanelFrame>(hole.x, hole.y), Millimetres(hole.diameter)});
  }
  Raster<PanelFrame> map(const std::vector<Outline>& gone, double shift_mm = 0, std::uint64_t seed = 7) const {
    rendered::Panel cut = panel;
    cut.gone = gone;
    rendered::Scanner scanner;
    scanner.dpi = 150, scanner.width_mm = panel.width, scanner.height_mm = panel.height;
    scanner.optics.seed = seed, scanner.optics.noise = noise;
    Raster<PanelFrame> map;
    map.resolution = scanner.nominal();
    map.pixels =
        scan_panel(cut, Face::kShow, rendered::lay(0, panel.height, shift_mm, shift_mm, 0, Face::kShow), scanner);
    map.origin = point<PanelFrame>(0, panel.height - map.height().count());
    return map;
  }
};

inline const Outline kLight = {{30, 30}, {42, 30}, {42, 44}, {30, 44}};  // in the lightest strip
inline const Outline kDark = {{72, 40}, {84, 41}, {83, 52}, {73, 51}};   // in the darkest strip
inline const Outline kBetween = {{52, 60}, {62, 60}, {57, 70}};

// A sheet of neutral strips, as silver-dyed, weathered and bleached woods are.
struct GreyShelf : Shelf {
  GreyShelf() {
    for (std::size_t i = 0; i < panel.strips.size(); ++i) {
      const float level = std::array{205.0F, 150.0F, 96.0F}[i % 3];
      panel.strips[i].colour = {level, level, level};
    }
  }
};

// What shows where wood is gone, blurred as the map is.
inline void open_up(Raster<PanelFrame>& map, const Outline& outline, const cv::Scalar& seen) {
  std::vector<cv::Point> corners;
  for (const auto& p : outline) {
    double column = 0, row = 0;
    map.to_pixels(point<PanelFrame>(p.x, p.y), column, row);
    corners.emplace_back(cvRound(16 * (column - 0.5)), cvRound(16 * (row - 0.5)));
  }
  cv::fillPoly(map.pixels, std::vector<std::vector<cv::Point>>{corners}, seen, cv::LINE_AA, 4);
}

}  // namespace veneer::reconciled
