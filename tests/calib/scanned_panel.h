// Cells with a drawn panel on the glass: one whose scanner is perfect, one whose scanner is warped and calibrated.
#pragma once

#include <gtest/gtest.h>

#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "calib/point_fit.h"
#include "calib/registration.h"
#include "tests/support/rendered_panel.h"

namespace veneer::scanned {

using calib::FitResidual;
using calib::PanelFiducials;
using calib::ScannerModel;
using calib::TileView;

using GlassFromPanel = Isometry2<GlassFrame, PanelFrame>;

// The scanner's map as a certificate would give it, from two scans of a small AprilGrid sheet.
inline ScannerModel calibrated(const rendered::Scanner& scanner) {
  calib::AprilGrid grid;
  grid.columns = 7, grid.rows = 5;
  const rendered::PrintedGrid sheet(grid);
  std::vector<calib::GridScan> scans;
  for (const auto& [x, y, angle] : {std::tuple{6.0, 122.0, 0.3}, {22.0, 134.0, -0.5}})
    scans.push_back(calib::grid_scan(
        scan_grid(sheet, Isometry2<GlassFrame, SheetFrame>(degrees(angle), point<GlassFrame>(x, -y)), scanner),
        scanner.nominal(), grid));
  calib::ScannerFitOptions options;
  options.min_tags = 20;
  const auto fit = calib::fit_scanner_model(scans, grid, options);
  EXPECT_TRUE(fit.ok());
  return ScannerModel(fit->model);
}

struct Cell {
  rendered::Panel panel = rendered::sample_panel();
  rendered::Scanner scanner;
  ScannerModel model;

  explicit Cell(bool warped = false, double dpi = 150) {
    if (warped) scanner = rendered::warped_scanner();
    scanner.dpi = dpi;
    scanner.width_mm = 180, scanner.height_mm = 140;
    if (warped) model = calibrated(scanner);
  }
  // The whole panel on the glass.
  GlassFromPanel whole(Face face, double angle_deg = 1.5) const {
    return rendered::lay(75, 55, 90, 70, angle_deg, face);
  }
  TileView scan(Face face, const GlassFromPanel& glass_from_panel, const std::string& name = "scan 1") const {
    return calib::view_tile(scan_panel(panel, face, glass_from_panel, scanner), scanner.nominal(), name);
  }
};

// The perfect cell and its panel, whole on the glass; drawn once.
inline const Cell& plain_cell() {
  static const Cell cell;
  return cell;
}
inline const TileView& plain_show() {
  static const TileView view = plain_cell().scan(Face::kShow, plain_cell().whole(Face::kShow), "scan 7");
  return view;
}
// The same panel on a later day, the other way round.
inline const TileView& plain_later() {
  static const TileView view = plain_cell().scan(Face::kShow, plain_cell().whole(Face::kShow, 178));
  return view;
}
inline PanelFiducials plain_fiducials() {
  static const auto found = register_first_scan(std::span(&plain_show(), 1), ScannerModel());
  if (!found) throw std::runtime_error(found.error().message);
  return found->fiducials;
}
// The warped cell with its certificate.
inline const Cell& warped_cell() {
  static const Cell cell(true);
  return cell;
}

// Errors over a 10 mm lattice of true points, after the best isometry on the true fiducials: docs/FRAMES.md.
inline FitResidual error_of(const Cell& cell, const calib::ScanMap& map, const GlassFromPanel& truth, Face face,
                            const PanelFiducials& found) {
  std::vector<Point<PanelFrame>> is, seems;
  for (const auto& tag : cell.panel.tags) {
    if (tag.face != face || found.tag(tag.id) == nullptr) continue;
    const auto corners = tag.corners();
    for (std::size_t i = 0; i < 4; ++i) {
      is.push_back(corners[i]);
      seems.push_back(found.tag(tag.id)->corners[i]);
    }
  }
  const auto true_from_found = calib::fit_isometry<PanelFrame, PanelFrame>(is, seems);
  is.clear(), seems.clear();
  for (double y = 5; y < cell.panel.height; y += 10)
    for (double x = 5; x < cell.panel.width; x += 10) {
      const Point<ScanFrame> seen = cell.scanner.scan_from_glass(truth * point<PanelFrame>(x, y));
      if (seen.x.count() < 0 || seen.y.count() < 0 || seen.x.count() > cell.scanner.columns() ||
          seen.y.count() > cell.scanner.rows())
        continue;
      is.push_back(point<PanelFrame>(x, y));
      seems.push_back(true_from_found * (map * seen));
    }
  return calib::residual_of(Isometry2<PanelFrame, PanelFrame>(), std::span<const Point<PanelFrame>>(is),
                            std::span<const Point<PanelFrame>>(seems));
}

}  // namespace veneer::scanned
