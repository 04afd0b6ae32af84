// What a scanner's pixels mean in true millimetres: a smooth map, fitted to scans of the AprilGrid sheet.
//
// GlassFrame: true mm on the scanner's glass, +x right and +y up *in the picture*, origin at the scan's upper left
// corner (so y is negative on the glass). Nominal millimetres are pixels (centres at +0.5) divided by the claimed
// resolution, hence one model serves all resolutions. The model is nominal mm plus a displacement, a tensor-product
// cubic B-spline on a regular lattice; scale and skew are part of it.
//
// ScannerModelData is plain numbers for storage. Values; thread-safe as such.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "calib/april_grid.h"
#include "calib/error_lattice.h"
#include "calib/tag_detector.h"

namespace veneer {

struct GlassFrame {  // true mm on a scanner's glass, as seen in its picture
  using Length = Millimetres;
};

namespace calib {

// Lattice of spline coefficients over nominal mm (x right, y down, as the pixels run). Coefficient (c, r) is number
// r * columns + c and belongs to the B-spline centred at ((c - 1) * spacing_x_mm, (r - 1) * spacing_y_mm). Empty
// coefficients stand for a perfect scanner.
struct ScannerModelData {
  int columns = 0, rows = 0;
  double spacing_x_mm = 0, spacing_y_mm = 0;
  std::vector<double> shift_x_mm, shift_y_mm;  // added to (nominal x, -nominal y)
  // Where the sheet lay when it was fitted, nominal mm; beyond it the map is extrapolated.
  double covered_from_x_mm = 0, covered_from_y_mm = 0, covered_to_x_mm = 0, covered_to_y_mm = 0;
};

class ScannerModel {
 public:
  ScannerModel() = default;  // the perfect scanner
  explicit ScannerModel(ScannerModelData data);

  Point<GlassFrame> glass_from_scan(const Point<ScanFrame>& p, ScanResolution nominal) const;
  // Undoes glass_from_scan to 1e-9 mm.
  Point<ScanFrame> scan_from_glass(const Point<GlassFrame>& p, ScanResolution nominal) const;
  const ScannerModelData& data() const { return data_; }

 private:
  ScannerModelData data_;
};

// One scan of the sheet, lying anywhere on the glass at any angle, face down.
struct GridScan {
  std::vector<Tag<ScanFrame>> tags;
  ScanResolution nominal;
  int width_px = 0, height_px = 0;
};
GridScan grid_scan(const cv::Mat& picture, ScanResolution nominal, const AprilGrid& grid = {});

struct ScannerCertificateData {
  ScannerModelData model;
  int scans = 0, tags = 0, dropped = 0;
  Millimetres rms{0}, max{0};                    // tag corners, model against sheet
  Millimetres left_out_rms{0}, left_out_max{0};  // corners of tags the fit had not seen, inside the covered area
  // Whole scans of which the fit had seen the others only, beyond what these covered too: how well it will serve at
  // another scan. Nothing of a single one.
  std::optional<Millimetres> other_scan_rms, other_scan_max;
  double scale_x = 1, scale_y = 1;  // true mm per nominal mm, mean over the covered area
  double covered_fraction = 0;      // of the glass
  // Over the glass, nominal mm: x right, y down from the scan's upper left corner. Of two scans or more: one alone says
  // nothing of another.
  std::optional<ErrorLattice> predicted;
};

struct ScannerFitOptions {
  Millimetres lattice{20};    // spacing of the spline's lattice
  Millimetres max_rms{0.05};  // fitted and left out
  Millimetres max_single{0.10};
  int min_tags = 40;  // per scan
};

// One scan suffices for a map, but nothing tells how well it will serve at the next; two or three at different places
// do, cover more of the glass and average the noise. kNotFound when a scan does not show the sheet, kRefused when a
// residual is over the limits.
Result<ScannerCertificateData> fit_scanner_model(std::span<const GridScan> scans, const AprilGrid& grid = {},
                                                 const ScannerFitOptions& options = {});

}  // namespace calib
}  // namespace veneer
