// What the twin's seed draws: the true parameters of the simulated devices. All of it is written to truth/cell.json for
// veneer-proof; the cell never reads it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "drivers/sim/plane.h"
#include "drivers/sim/roughness.h"

namespace veneer::sim {

// What the machine's axes make of a commanded position (MachineFrame mm, 0 to travel):
// bed = ((1 + x_scale) * X + skew * Y, (1 + y_scale) * Y). Nothing outside the twin knows it but by measuring burns.
struct MachineAxes {
  double x_scale = 0, y_scale = 0;  // relative errors, up to 0.002
  double skew = 0;                  // radians, up to 0.001

  Vec2 bed_from_commanded(Vec2 commanded) const {
    return {(1 + x_scale) * commanded.x + skew * commanded.y, (1 + y_scale) * commanded.y};
  }
};

// Sizes and how bad the devices may be; the exact values are drawn from the seed. Read from the configuration.
struct TwinSettings {
  std::uint64_t seed = 1;
  double time_scale = 1;
  double sheet_dpi = 400;  // resolution of the sheets' own rasters
  struct Scanner {
    double width_mm = 320, height_mm = 300;
    double warp_mm = 0.10, wobble_mm = 0.025, scale_error = 0.003;
    double psf_px = 0.6, noise = 1.6, dust = 1.0, uneven_light = 0.04;
  } scanner;
  struct Camera {
    int width_px = 4000, height_px = 3000;
    double tilt_deg = 12, noise = 2.0, uneven_light = 0.15;
  } camera;
  struct Bed {
    double width_mm = 520, height_mm = 380;
  } bed;
  struct Laser {
    double axis_scale_error = 0.002, axis_skew = 0.001;
    double through_energy = 0.016;   // power fraction * s / mm above which the beam cuts through
    double engrave_energy = 0.0004;  // below this nothing shows
    double engrave_width_mm = 0.20;
  } laser;
  Roughness rough;
};

// A smooth error of place: (x, y) -> (dx, dy) mm, polynomial over the glass plus a periodic wobble.
struct ScannerTruth {
  double width_mm = 320, height_mm = 300;
  double x_scale = 0, y_scale = 0, skew = 0;
  std::array<double, 6> warp_x{}, warp_y{};  // mm, coefficients of u2, uv, v2, u3, u2v, v3 with u, v in [-1, 1]
  struct Wave {
    double amplitude_mm = 0, wavelength_mm = 60, phase_rad = 0;
  };
  Wave wobble_xx, wobble_xy, wobble_yx, wobble_yy;  // wobble_xy: error of x as a function of y
  double psf_px = 0.6, noise = 1.6, dust = 1.0, uneven_light = 0.04;
  std::uint64_t light_seed = 0;
  std::array<double, 3> lamp{1, 1, 1};  // blue, green, red

  // True glass mm of what the scanner shows at nominal mm (pixel / nominal px_per_mm, y up).
  Vec2 glass_from_nominal(Vec2 nominal) const;
  Vec2 nominal_from_glass(Vec2 glass) const;  // exact inverse, by iteration
};

// camera = R * (bed - position): +z of the camera points at the bed. Brown-Conrady lens.
struct CameraTruth {
  int width_px = 4000, height_px = 3000;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  std::array<double, 9> rotation{};  // row-major, camera_from_bed
  std::array<double, 3> position{};  // mm in the bed frame (z up)
  double noise = 2.0, uneven_light = 0.15;
  std::uint64_t light_seed = 0;

  Vec2 pixel(Vec2 bed_mm, double z_mm) const;  // pixel centres at +0.5
  Vec2 bed_at(Vec2 pixel, double z_mm) const;  // exact inverse, by iteration
};

struct CellTruth {
  TwinSettings settings;
  MachineAxes axes;
  double kerf_mm = 0.27;  // full width burnt away
  ScannerTruth scanner;
  CameraTruth camera;
};

CellTruth draw_cell_truth(const TwinSettings& settings);
// The scanner as it is at one scan: its carriage never runs twice the same way, its lamp ages and warms up.
ScannerTruth scanner_of_today(const CellTruth& truth, std::uint64_t scan);
Status save_cell_truth(const CellTruth& truth, const std::filesystem::path& file);
Result<CellTruth> load_cell_truth(const std::filesystem::path& file);

}  // namespace veneer::sim
