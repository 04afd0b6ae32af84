#include "daemon/orders/calibration_work.h"

#include <cmath>

#include "calib/burnt_pattern.h"
#include "calib/kerf_meter.h"
#include "calib/machine_axes.h"
#include "daemon/store/calibration.h"
#include "daemon/store/certificate_payload.h"
#include "planner/cutting/calibration_pattern.h"
#include "planner/pictures/pictures.h"

namespace veneer::daemon {

Result<calib::GridScan> read_grid_scan(const ReadGridScan& order, const std::filesystem::path& /*folder*/,
                                       const TaskProgress& progress) {
  const auto picture = planner::load_scan(order.file);
  if (!picture) return picture.error();
  progress(0.55, "looking for tags");
  auto seen = calib::grid_scan(picture->pixels, order.nominal);
  if (seen.tags.empty())
    return Error{ErrorCode::kRefused,
                 "the AprilGrid sheet is not on the glass: lay it there, print down, and try again"};
  return seen;
}

Result<Fit> fit_scanner(const FitScanner& order, const std::filesystem::path& /*folder*/,
                        const TaskProgress& progress) {
  progress(0.7, "fitting the scanner's map");
  const auto fit = calib::fit_scanner_model(order.scans);
  if (!fit) return fit.error();
  Fit out{to_payload(*fit), fit->rms};
  out.payload["scan_px"] = {order.scans.back().width_px, order.scans.back().height_px};
  return out;
}

Result<GridViewRead> read_grid_view(const ReadGridView& order, const std::filesystem::path& /*folder*/,
                                    const TaskProgress& progress) {
  const auto picture = planner::load_picture(order.file);
  if (!picture) return picture.error();
  progress(0.4, "looking for tags");
  GridViewRead out{calib::grid_view(*picture, order.height), picture->cols, picture->rows};
  if (out.view.tags.empty())
    return Error{ErrorCode::kRefused,
                 "the AprilGrid sheet is not seen on the bed: lay it there, print up, light the bed and try again"};
  return out;
}

Result<Fit> fit_camera(const FitCamera& order, const std::filesystem::path& /*folder*/, const TaskProgress& progress) {
  progress(0.6, "fitting lens and place");
  const auto fit = calib::fit_camera_model(order.views, order.width_px, order.height_px);
  if (!fit) return fit.error();
  return Fit{to_payload(*fit), fit->rms};
}

Result<Fit> read_pattern_view(const ReadPatternView& order, const std::filesystem::path& /*folder*/,
                              const TaskProgress& progress) {
  const auto picture = planner::load_picture(order.file);
  if (!picture) return picture.error();
  const calib::CameraModel camera(order.camera);
  if (const Status same = require_picture_size(camera, picture->cols, picture->rows); !same) return same.error();
  const auto burnt = planner::make_pattern(order.pattern);
  if (!burnt) return burnt.error();
  progress(0.8, "finding the burnt rings");
  const auto found = calib::find_burnt_pattern(*picture, camera, order.height, burnt->rings);
  if (!found) return found.error();
  const auto fit = calib::fit_machine_axes(*found, camera, order.height, order.camera_off);
  if (!fit) return fit.error();
  return Fit{to_payload(*fit, CertificateId{order.camera_certificate}, order.pattern, order.reach), fit->rms};
}

Result<Fit> read_pattern_scan(const ReadPatternScan& order, const std::filesystem::path& /*folder*/,
                              const TaskProgress& progress) {
  const auto picture = planner::load_scan(order.file);
  if (!picture) return picture.error();
  Calibration calibration;
  calibration.scan_size = order.scan_size;
  if (const Status same = require_scan_size(calibration, picture->pixels.cols, picture->pixels.rows); !same)
    return same.error();
  const auto burnt = planner::make_pattern(order.pattern);
  if (!burnt) return burnt.error();
  progress(0.7, "measuring the kerf");
  // The true resolution: how many pixels the scanner really has for a millimetre in the middle of the glass.
  const calib::ScannerModel scanner(order.scanner);
  const double cx = picture->pixels.cols / 2.0, cy = picture->pixels.rows / 2.0;
  const auto a = scanner.glass_from_scan(point<ScanFrame>(cx - 500, cy - 500), order.nominal);
  const auto b = scanner.glass_from_scan(point<ScanFrame>(cx + 500, cy + 500), order.nominal);
  const ScanResolution resolution{std::hypot(1000.0, 1000.0) / distance(a, b).count()};
  const auto measured = calib::measure_kerf(picture->pixels, resolution, burnt->kerf_lines);
  if (!measured) return measured.error();
  return Fit{to_payload(*measured), measured->spread};
}

}  // namespace veneer::daemon
