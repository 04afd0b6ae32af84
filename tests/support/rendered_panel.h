// Sheets drawn at a known place, for vision tests: what a scanner or a camera would see of them, to a fraction of a
// micrometre. Nothing here is shared with the twin, so that errors cannot cancel.
//
// A sheet is a function of millimetres: `colour(place, face)` is the colour (BGR, 0 to 255) seen at a place of the
// sheet when looking at that face. Places are always in the sheet's own frame as seen from its show (printed) face.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

#include "base/frames.h"
#include "calib/april_grid.h"
#include "calib/fiducials.h"
#include "calib/scanner_model.h"

namespace veneer::rendered {

using Colour = cv::Vec3f;  // BGR, 0 to 255

constexpr float kLid = 244;  // what a scanner sees where nothing lies

// The bits of tag 36h11 `id` as printed: 10 x 10 cells, true = black, row 0 at the top. Cells 1 to 8 are the square.
using TagCells = std::array<std::array<bool, 10>, 10>;
TagCells tag_cells(int id);

struct GluedTag {
  int id = 0;
  Face face = Face::kShow;
  double x = 0, y = 0;       // centre, sheet mm
  double angle_deg = 0;      // how its own face shows it turned, counter-clockwise
  double size = 14;          // black square; a quiet zone of one cell around it
  bool upside_down = false;  // printed by a library that draws the family turned by 180 degrees
  // In the detector's order.
  std::array<Point<PanelFrame>, 4> corners() const;
};

struct RoundHole {
  double x = 0, y = 0, diameter = 6;
};

struct Strip {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  Colour colour{60, 110, 160};
  double grain = 0.12;  // relative variation along the growth rings
};

struct Panel {
  double width = 150, height = 110;
  Colour board{140, 134, 130};
  Colour back{150, 185, 205};
  std::vector<Strip> strips;
  std::vector<GluedTag> tags;
  std::vector<RoundHole> holes;                // through: the lid is seen
  std::vector<RoundHole> screws;               // dark
  std::vector<std::vector<cv::Point2d>> gone;  // cut out, sheet mm
  std::uint64_t seed = 1;

  bool is_sheet(double x, double y) const;  // false beside it, in holes and where pieces are gone
  bool is_wood(double x, double y) const;   // of a strip, and there
  Colour colour(double x, double y, Face face) const;
};

// A panel with five tags and four holes on each face, asymmetric, and as many strips as fit; light to very dark.
Panel sample_panel(double width = 150, double height = 110, std::uint64_t seed = 1);

// White paper with the grid's tags, a quiet border of one cell; nothing on its back.
struct PrintedGrid {
  calib::AprilGrid grid;
  std::vector<TagCells> cells;
  explicit PrintedGrid(const calib::AprilGrid& grid);
  Colour colour(double x, double y) const;
};

struct Optics {
  double psf_px = 0.6, noise = 1.5;
  double uneven_light = 0;  // relative, from one corner to the other
  int samples = 6;          // per axis in pixels that an edge crosses
  std::uint64_t seed = 7;
};

// What a scanner does to millimetres. glass = nominal * scale + warp, y up on the glass.
struct Scanner {
  double dpi = 300;
  double width_mm = 160, height_mm = 120;
  double scale_x = 1, scale_y = 1, skew = 0;
  double warp_mm = 0, wobble_mm = 0, wavelength_mm = 60;
  Optics optics;

  ScanResolution nominal() const { return ScanResolution::from_dpi(dpi); }
  int columns() const { return static_cast<int>(width_mm * nominal().px_per_mm); }
  int rows() const { return static_cast<int>(height_mm * nominal().px_per_mm); }
  Point<GlassFrame> glass_from_scan(const Point<ScanFrame>& p) const;
  Point<ScanFrame> scan_from_glass(const Point<GlassFrame>& p) const;
};
// 0.10 / 0.08 mm of smooth warp, 0.03 mm of wobble, scale +0.3 / -0.2 %.
Scanner warped_scanner();

// Draws columns x rows pixels; `colour_at` gets a pixel's (or sample's) place, y down, centres at +0.5.
cv::Mat render(int columns, int rows, const Optics& optics, const std::function<Colour(double, double)>& colour_at);

cv::Mat scan_panel(const Panel& panel, Face face, const Isometry2<GlassFrame, PanelFrame>& glass_from_panel,
                   const Scanner& scanner);
cv::Mat scan_grid(const PrintedGrid& sheet, const Isometry2<GlassFrame, SheetFrame>& glass_from_sheet,
                  const Scanner& scanner);

// Where a panel must lie so that its point (x, y) comes to (gx, gy) of the picture's millimetres (y down), turned by
// `angle_deg`. Improper for the back.
Isometry2<GlassFrame, PanelFrame> lay(double x, double y, double gx, double gy, double angle_deg, Face face);

}  // namespace veneer::rendered
