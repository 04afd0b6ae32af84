// What the cell's certificates say at this moment.
//
// Four certificates: scanner (its metric map), camera (lens and place over the bed), axes (machine_from_bed, and the
// camera re-anchored to that bed frame; bound to the camera certificate it was made with), kerf. Each carries the name
// of the device, or devices, it was made on, and is void on another.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/calibration_pattern.h"
#include "base/result.h"
#include "calib/camera_model.h"
#include "calib/error_lattice.h"
#include "calib/scanner_model.h"
#include "daemon/store/certificate_payload.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

enum class CertificateState {
  kMissing,      // none was ever issued
  kValid,        // in force
  kExpired,      //
  kOtherDevice,  // made on another device, or on this one before it was set otherwise
  kReplaced,     // a newer one took its place; of axes: the place of the camera certificate they were made with
  kAhead,        // issued later than this machine's clock
};
const char* to_string(CertificateState state);  // as the API has it: "missing", "other_device", ...

// Of the certificate of a kind that was issued last, the only one that can be in force.
struct CertificateStanding {
  CertificateState state = CertificateState::kMissing;
  CertificateId certificate;  // {0}: missing
  std::string expires_at;
  // What it is at `now`, no earlier than when this was found.
  CertificateState at(const std::string& now) const;
};

struct Calibration {
  std::optional<calib::ScannerModel> scanner;
  std::optional<std::array<int, 2>> scan_size;  // columns and rows of the scans it was made from, pixels
  std::string scanner_make;                     // of the device they came from; "" where that is not known
  std::optional<calib::CameraModel> camera;     // provisional bed frame; for burning the pattern only
  CertificateId camera_certificate;
  Millimetres camera_off{0};  // rms, of points its fit had not seen; 0 where its certificate does not say
  std::optional<BedCalibration> bed;
  std::optional<Millimetres> kerf;
  std::optional<PatternLayout> pattern;                         // that the axes were measured with
  std::map<db::CertificateKind, CertificateStanding> standing;  // of every kind
};

// A certificate and what is so of it. Axes count only with the camera certificate they were made with, and while that
// one does.
struct JudgedCertificate {
  db::CertificateRecord record;
  CertificateState state = CertificateState::kMissing;
  std::string made_on;              // the device, or devices; "" where the certificate names none
  std::vector<std::string> doubts;  // of one in force: how well it will serve, and for how long, each as a sentence
};

// How well a certificate will serve where nothing was measured, by how it was made: each as a sentence; mostly empty.
std::vector<std::string> doubts_of_payload(db::CertificateKind kind, const nlohmann::json& payload);

// What a certificate predicts of its error at a place (calib/error_lattice.h).
struct ErrorAt {
  std::string frame;  // whose mm the place was told in: "scan", "bed"; "" where nothing is predicted
  std::optional<calib::PredictedError> predicted;
  std::string not_predicted;  // else why not, as a sentence
};
// x and y are mm: of a scanner's certificate to the right and down from the upper left corner of a scan, of the axes'
// in BedFrame. kInvalidArgument beyond the places that it tells of, kStorage when it cannot be read.
Result<ErrorAt> error_at(const db::CertificateRecord& certificate, double x_mm, double y_mm);

// The devices that a certificate of this kind is bound to, as one name; "" when one of them has none.
std::string device_name(db::CertificateKind kind, const CellDevices& devices);

// Certificates in force at `now` on the devices of the repositories; all others stay empty, and `standing` says why.
Result<Calibration> load_calibration(Repositories& repositories, const std::string& now);
// The same for a run that is on, or still owes a look: a certificate that it began with does not expire under it.
Result<Calibration> load_calibration_of_run(Repositories& repositories, const std::string& now);
// Was the camera or were the axes calibrated since the run began? Then places on the bed are told in another frame than
// its own. Never of a run that did not note its certificates.
Result<bool> bed_frame_has_changed(Repositories& repositories, db::RunId run);
// At most `limit` certificates, the one issued last first, from before `before` on; {0}: from the last one. Those that
// expire until `soon` say so among their doubts.
Result<std::vector<JudgedCertificate>> judged_certificates(Repositories& repositories, const std::string& now,
                                                           CertificateId before = {}, int limit = -1,
                                                           const std::string& soon = "");

// kRefused with the command that makes the missing certificate.
Status require_scanner(const Calibration& calibration);
Status require_cutting(const Calibration& calibration);
// kRefused when a picture has another size than those its device's certificate was made from.
Status require_picture_size(const calib::CameraModel& camera, int width_px, int height_px);
// kRefused when a scan came from another make of scanner than the certificate; where either is not known, Ok.
Status require_make(const Calibration& calibration, const std::string& make);
Status require_scan_size(const Calibration& calibration, int columns, int rows);

}  // namespace veneer::daemon
