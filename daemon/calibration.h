// What the cell's certificates say at this moment, and how they are written as certificate payloads (JSON).
//
// Four certificates: scanner (its metric map), camera (lens and place over the bed), axes (machine_from_bed, and the
// camera re-anchored to that bed frame; bound to the camera certificate it was made with), kerf.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/frames.h"
#include "base/result.h"
#include "calib/camera_fit.h"
#include "calib/camera_model.h"
#include "calib/kerf_meter.h"
#include "calib/machine_axes.h"
#include "calib/scanner_model.h"
#include "daemon/database_thread.h"

namespace veneer::daemon {

// Lens and axes together: what finds a panel on the bed and tells the machine where to go.
struct BedCalibration {
  calib::CameraModel camera;  // over the BedFrame that machine_from_bed starts from
  Affine2<MachineFrame, BedFrame> machine_from_bed;
};

struct Calibration {
  std::optional<calib::ScannerModel> scanner;
  std::optional<calib::CameraModel> camera;  // provisional bed frame; for burning the pattern only
  CertificateId camera_certificate;
  std::optional<BedCalibration> bed;
  std::optional<Millimetres> kerf;
  std::optional<Box<MachineFrame>> pattern_area;  // of the pattern the axes were measured with
};

// Certificates in force at `now`; those that are missing or expired stay empty.
Result<Calibration> load_calibration(Repositories& repositories, const std::string& now);

// kRefused with the command that makes the missing certificate.
Status require_scanner(const Calibration& calibration);
Status require_cutting(const Calibration& calibration);

nlohmann::json to_payload(const calib::ScannerCertificateData& scanner);
nlohmann::json to_payload(const calib::CameraFit& camera);
nlohmann::json to_payload(const calib::MachineAxes& axes, CertificateId camera, const Box<MachineFrame>& pattern_area);
nlohmann::json to_payload(const calib::KerfMeasurement& kerf);

}  // namespace veneer::daemon
