#include "daemon/services/calibration_service.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "calib/burnt_pattern.h"
#include "calib/kerf_meter.h"
#include "calib/machine_axes.h"
#include "daemon/services/calibration.h"

namespace veneer::daemon {

CalibrationService::CalibrationService(ScannerDriver& scanner, CameraDriver& camera, DatabaseThread& database,
                                       const Config& config, Logger log)
    : scanner_(scanner), camera_(camera), database_(database), config_(config), log_(std::move(log)) {}

CellDevices cell_devices(const ScannerDriver& scanner, const CameraDriver& camera, const Config& config) {
  const LaserConfig& laser = config.laser;
  CellDevices devices{fmt::format("{} at {:g} dpi", scanner.device(), config.scanner.dpi), camera.device(), "twin"};
  if (on_twin(laser)) return devices;
  devices.laser = fmt::format("{} {}", laser.kind, laser.port);
  if (laser.kind == "lihuiyu")
    devices.laser += fmt::format(" {:g} x {:g} mm", laser.travel_x.count(), laser.travel_y.count());
  return devices;
}

Status CalibrationService::issue(db::CertificateKind kind, Millimetres rms, nlohmann::json payload,
                                 CalibrationOutcome& outcome) {
  payload["device"] = device_name(kind, cell_devices(scanner_, camera_, config_));
  outcome.rms = rms;
  outcome.payload = payload.dump();
  db::CertificateRecord record;
  record.kind = kind;
  record.issued_at = utc_timestamp();
  record.expires_at = utc_timestamp(std::chrono::hours(24) * config_.panel.calibration_days);
  record.rms = rms;
  record.payload = outcome.payload;
  auto id = database_.call([&](Repositories& r) { return r.certificates.issue(record); });
  if (!id) return id.error();
  outcome.certificate = *id;
  log_->info("certificate {} issued: {}, rms {:.4f} mm", id->value, db::to_string(kind), rms.count());
  return Ok();
}

Result<CalibrationOutcome> CalibrationService::scanner(bool more, const TaskProgress& progress,
                                                       const std::stop_token& stop) {
  progress(0.02, "scanning the AprilGrid sheet");
  auto image = scanner_.scan(
      ScanResolution::from_dpi(config_.scanner.dpi),
      [&](double f) { progress(0.02 + 0.5 * f, "scanning the AprilGrid sheet"); }, stop);
  if (!image) return image.error();
  progress(0.55, "looking for tags");
  auto seen = calib::grid_scan(image->pixels, image->nominal);
  if (seen.tags.empty())
    return Error{ErrorCode::kRefused,
                 "the AprilGrid sheet is not on the glass: lay it there, print down, and try again"};
  grid_scans_.push_back(std::move(seen));
  CalibrationOutcome outcome{"scanner", grid_scans_.size(), {}, {}, "{}"};
  if (more) return outcome;
  progress(0.7, "fitting the scanner's map");
  const auto scans = std::exchange(grid_scans_, {});
  auto fit = calib::fit_scanner_model(scans);
  if (!fit) return fit.error();
  nlohmann::json payload = to_payload(*fit);
  payload["scan_px"] = {image->pixels.cols, image->pixels.rows};
  if (Status issued = issue(db::CertificateKind::kScanner, fit->rms, std::move(payload), outcome); !issued)
    return issued.error();
  return outcome;
}

Result<CalibrationOutcome> CalibrationService::camera(bool more, Millimetres height, const TaskProgress& progress) {
  progress(0.05, "photographing the AprilGrid sheet");
  auto picture = camera_.capture();
  if (!picture) return picture.error();
  progress(0.4, "looking for tags");
  auto view = calib::grid_view(*picture, height);
  if (view.tags.empty())
    return Error{ErrorCode::kRefused,
                 "the AprilGrid sheet is not seen on the bed: lay it there, print up, light the bed and try again"};
  grid_views_.push_back(std::move(view));
  picture_width_ = picture->cols;
  picture_height_ = picture->rows;
  CalibrationOutcome outcome{"camera", grid_views_.size(), {}, {}, "{}"};
  if (more) return outcome;
  progress(0.6, "fitting lens and place");
  const auto views = std::exchange(grid_views_, {});
  auto fit = calib::fit_camera_model(views, picture_width_, picture_height_);
  if (!fit) return fit.error();
  if (Status issued = issue(db::CertificateKind::kCamera, fit->rms, to_payload(*fit), outcome); !issued)
    return issued.error();
  return outcome;
}

Box<MachineFrame> CalibrationService::area() const {
  const std::lock_guard lock(area_mutex_);
  return area_;
}

Result<CalibrationPattern> CalibrationService::pattern(const Calibration& calibration) const {
  planner::PatternOptions options;
  options.area = area();
  if (options.area.empty() && calibration.pattern_area) options.area = *calibration.pattern_area;
  if (options.area.empty())
    return Error{ErrorCode::kRefused, "no pattern was burnt yet: run veneerctl calibrate laser first"};
  return planner::make_pattern(options);
}

Result<LaserJob> CalibrationService::pattern_job(const Box<MachineFrame>& travel, Millimetres board_width,
                                                 Millimetres board_height) {
  constexpr Millimetres kOffCentre{25};  // 20 mm of placing, 5 mm of wood beyond the outer rings
  constexpr double kAskew = 0.07;        // 4 degrees
  const Millimetres half_width = board_width / 2 - kOffCentre - board_height * (kAskew / 2);
  const Millimetres half_height = board_height / 2 - kOffCentre - board_width * (kAskew / 2);
  const Point<MachineFrame> middle{(travel.min.x + travel.max.x) / 2, (travel.min.y + travel.max.y) / 2};
  {
    const std::lock_guard lock(area_mutex_);
    area_ = {};
    if (half_width > Millimetres(0) && half_height > Millimetres(0)) {
      area_.add({std::max(travel.min.x, middle.x - half_width), std::max(travel.min.y, middle.y - half_height)});
      area_.add({std::min(travel.max.x, middle.x + half_width), std::min(travel.max.y, middle.y + half_height)});
    }
  }
  planner::PatternOptions options;
  options.area = area();
  auto made = planner::make_pattern(options);
  if (!made)
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("a board of {:.0f} x {:.0f} mm is too small for the pattern: take one of 250 x 250 mm or more",
                    board_width.count(), board_height.count())};
  planner::Recipe recipe;
  recipe.cut_speed = config_.recipe.cut_speed, recipe.cut_power = config_.recipe.cut_power;
  recipe.engrave_speed = config_.recipe.engrave_speed, recipe.engrave_power = config_.recipe.engrave_power;
  return LaserJob{planner::pattern_strokes(*made, recipe)};
}

Result<CalibrationOutcome> CalibrationService::axes(Millimetres height, const TaskProgress& progress) {
  progress(0.7, "photographing the pattern");
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (!calibration->camera)
    return Error{ErrorCode::kRefused,
                 "the bed camera has no valid certificate: run veneerctl calibrate camera before calibrate laser"};
  auto burnt = pattern(*calibration);
  if (!burnt) return burnt.error();
  auto picture = camera_.capture();
  if (!picture) return picture.error();
  if (const Status same = require_picture_size(*calibration->camera, picture->cols, picture->rows); !same)
    return same.error();
  progress(0.8, "finding the burnt rings");
  auto found = calib::find_burnt_pattern(*picture, *calibration->camera, height, burnt->rings);
  if (!found) return found.error();
  auto fit = calib::fit_machine_axes(*found, *calibration->camera);
  if (!fit) return fit.error();
  const Box<MachineFrame> burnt_area = area().empty() ? *calibration->pattern_area : area();
  CalibrationOutcome outcome{"axes", 1, {}, {}, "{}"};
  if (Status issued = issue(db::CertificateKind::kAxes, fit->rms,
                            to_payload(*fit, calibration->camera_certificate, burnt_area), outcome);
      !issued)
    return issued.error();
  return outcome;
}

Result<CalibrationOutcome> CalibrationService::kerf(const TaskProgress& progress, const std::stop_token& stop) {
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (const Status ready = require_scanner(*calibration); !ready) return ready.error();
  auto burnt = pattern(*calibration);
  if (!burnt) return burnt.error();
  progress(0.02, "scanning the burnt board");
  auto image = scanner_.scan(
      ScanResolution::from_dpi(config_.scanner.dpi),
      [&](double f) { progress(0.02 + 0.6 * f, "scanning the burnt board"); }, stop);
  if (!image) return image.error();
  if (const Status same = require_scan_size(*calibration, image->pixels.cols, image->pixels.rows); !same)
    return same.error();
  progress(0.7, "measuring the kerf");
  // The true resolution: how many pixels the scanner really has for a millimetre in the middle of the glass.
  const double cx = image->pixels.cols / 2.0, cy = image->pixels.rows / 2.0;
  const auto a = calibration->scanner->glass_from_scan(point<ScanFrame>(cx - 500, cy - 500), image->nominal);
  const auto b = calibration->scanner->glass_from_scan(point<ScanFrame>(cx + 500, cy + 500), image->nominal);
  const ScanResolution resolution{std::hypot(1000.0, 1000.0) / distance(a, b).count()};
  auto measured = calib::measure_kerf(image->pixels, resolution, burnt->kerf_lines);
  if (!measured) return measured.error();
  CalibrationOutcome outcome{"kerf", 1, {}, {}, "{}"};
  if (Status issued = issue(db::CertificateKind::kKerf, measured->spread, to_payload(*measured), outcome); !issued)
    return issued.error();
  return outcome;
}

}  // namespace veneer::daemon
