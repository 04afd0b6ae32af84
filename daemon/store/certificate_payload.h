// What a certificate of each kind says, as the JSON that the database keeps of it.
//
// Readers throw nlohmann::json::exception where a payload is not one of ours. Pure.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/calibration_pattern.h"
#include "base/frames.h"
#include "base/ids.h"
#include "calib/camera_fit.h"
#include "calib/camera_model.h"
#include "calib/error_lattice.h"
#include "calib/kerf_meter.h"
#include "calib/machine_axes.h"
#include "calib/scanner_model.h"

namespace veneer::daemon {

// Lens and axes together: what finds a panel on the bed and tells the machine where to go.
struct BedCalibration {
  calib::CameraModel camera;  // over the BedFrame that machine_from_bed starts from
  Affine2<MachineFrame, BedFrame> machine_from_bed;
};

nlohmann::json to_payload(const calib::ScannerCertificateData& scanner);
nlohmann::json to_payload(const calib::CameraFit& camera);
// `reach`: of the beam, over which the error is predicted; empty: the pattern's area.
nlohmann::json to_payload(const calib::MachineAxes& axes, CertificateId camera, const PatternLayout& pattern,
                          const Box<MachineFrame>& reach = {});
nlohmann::json to_payload(const calib::KerfMeasurement& kerf);

// The device, or devices, that it was made on; "" where it names none, and of what is no payload at all.
std::string made_on(const nlohmann::json& payload);
calib::ScannerModel scanner_from_payload(const nlohmann::json& payload);
// Of the camera's, or of the camera within the axes'.
calib::CameraModel camera_from_payload(const nlohmann::json& payload);
// Of the axes'.
BedCalibration bed_from_payload(const nlohmann::json& payload);
// That the axes were measured with; nothing of certificates that do not say.
std::optional<PatternLayout> pattern_from_payload(const nlohmann::json& payload);
// REQUIRES: it has one ("predicted").
calib::ErrorLattice prediction_from_payload(const nlohmann::json& payload);

}  // namespace veneer::daemon
