#include "daemon/store/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr std::array kKinds = {db::CertificateKind::kScanner, db::CertificateKind::kCamera, db::CertificateKind::kAxes,
                               db::CertificateKind::kKerf};

std::string why_not_predicted(const db::CertificateRecord& certificate, const json& payload) {
  const auto number = certificate.id.value;
  switch (certificate.kind) {
    case db::CertificateKind::kKerf:
      return fmt::format("certificate {} is of the kerf, which has no places: ask that of the scanner or the axes",
                         number);
    case db::CertificateKind::kCamera:
      return fmt::format(
          "certificate {} is of the camera, whose error is not predicted place by place: ask that of the axes, which "
          "counts the camera's in",
          number);
    case db::CertificateKind::kScanner:
      if (payload.value("scans", 0) == 1)
        return fmt::format(
            "certificate {} was made of one scan, so its error at the next one is not predicted: calibrate with two "
            "more, the sheet at other places (--more)",
            number);
      break;
    case db::CertificateKind::kAxes:
      break;
  }
  return fmt::format(
      "certificate {} was made before errors were predicted, or too little was measured for it: calibrate again",
      number);
}

// The certificate of a kind that was issued last.
struct Last {
  CertificateStanding standing;
  json payload;                // null when there is none
  bool on_its_device = false;  // and neither expired nor ahead: what it says of the device is so
};

// `kept`: certificates that do not expire yet.
Result<Last> judge(Repositories& r, const db::CertificateRecord& record, const std::string& now,
                   std::span<const CertificateId> kept) {
  Last last{
      {CertificateState::kValid, record.id, record.expires_at}, json::parse(record.payload, nullptr, false), false};
  if (last.payload.is_discarded())
    return Error{ErrorCode::kStorage, fmt::format("certificate {} is damaged: calibrate again", record.id.value)};
  const auto on_this_laser = r.certificates.on_this_laser(record);
  if (!on_this_laser) return on_this_laser.error();
  const std::string device = device_name(record.kind, r.devices);
  if (record.issued_at > now)
    last.standing.state = CertificateState::kAhead;
  else if (record.expires_at <= now && std::ranges::find(kept, record.id) == kept.end())
    last.standing.state = CertificateState::kExpired;
  else if (!*on_this_laser || (!device.empty() && made_on(last.payload) != device))
    last.standing.state = CertificateState::kOtherDevice;
  else
    last.on_its_device = true;
  return last;
}

// Axes measured with another lens certificate say nothing about this one's bed frame.
void lean_on_camera(Last& axes, const Last& camera) {
  if (!axes.on_its_device) return;
  if (axes.payload.at("camera_certificate").get<std::int64_t>() != camera.standing.certificate.value) {
    axes.standing.state = CertificateState::kReplaced;
    return;
  }
  axes.standing.state = camera.standing.state;
  axes.standing.expires_at = std::min(axes.standing.expires_at, camera.standing.expires_at);
}

// Of every kind. Throws what the readers throw.
Result<std::map<db::CertificateKind, Last>> last_ones(Repositories& r, const std::string& now,
                                                      std::span<const CertificateId> kept = {}) {
  std::map<db::CertificateKind, Last> found;
  for (const auto kind : kKinds) {
    auto record = r.certificates.last(kind);
    if (!record) return record.error();
    Last& last = found[kind];
    if (!*record) continue;
    auto judged = judge(r, **record, now, kept);
    if (!judged) return judged.error();
    last = std::move(*judged);
  }
  lean_on_camera(found.at(db::CertificateKind::kAxes), found.at(db::CertificateKind::kCamera));
  return found;
}

Error unreadable(const json::exception& e) {
  return {ErrorCode::kStorage, fmt::format("a certificate cannot be read ({}): calibrate again", e.what())};
}

Status require_size(const char* device, const char* command, int width, int height, int wanted_width,
                    int wanted_height) {
  if (width == wanted_width && height == wanted_height) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format("the {} gave {} x {} pixels, its certificate was made from {} x {}: set it as it was, or run "
                  "veneerctl calibrate {}",
                  device, width, height, wanted_width, wanted_height, command)};
}

}  // namespace

std::string device_name(db::CertificateKind kind, const CellDevices& devices) {
  const auto both = [](const std::string& a, const std::string& b) {
    return a.empty() || b.empty() ? "" : a + ", " + b;
  };
  switch (kind) {
    case db::CertificateKind::kScanner:
      return devices.scanner;
    case db::CertificateKind::kCamera:
      return devices.camera;
    case db::CertificateKind::kAxes:
      return both(devices.camera, devices.laser);
    case db::CertificateKind::kKerf:
      return both(devices.scanner, devices.laser);
  }
  return "";
}

const char* to_string(CertificateState state) {
  switch (state) {
    case CertificateState::kMissing:
      return "missing";
    case CertificateState::kValid:
      return "valid";
    case CertificateState::kExpired:
      return "expired";
    case CertificateState::kOtherDevice:
      return "other_device";
    case CertificateState::kReplaced:
      return "replaced";
    case CertificateState::kAhead:
      return "ahead_of_clock";
  }
  return "missing";
}

CertificateState CertificateStanding::at(const std::string& now) const {
  return state == CertificateState::kValid && expires_at <= now ? CertificateState::kExpired : state;
}

static Result<Calibration> load(Repositories& r, const std::string& now, std::span<const CertificateId> kept) {
  try {
    const auto found = last_ones(r, now, kept);
    if (!found) return found.error();
    Calibration out;
    for (const auto& [kind, last] : *found) out.standing[kind] = last.standing;
    // Its payload, while it is in force.
    const auto in_force = [&](db::CertificateKind kind) {
      const Last& last = found->at(kind);
      return last.standing.state == CertificateState::kValid ? &last.payload : nullptr;
    };
    if (const json* scanner = in_force(db::CertificateKind::kScanner)) {
      out.scanner = scanner_from_payload(*scanner);
      if (const auto size = scanner->find("scan_px"); size != scanner->end())
        out.scan_size = size->get<std::array<int, 2>>();
      out.scanner_make = scanner->value("make", "");
    }
    if (const json* camera = in_force(db::CertificateKind::kCamera)) {
      out.camera = camera_from_payload(*camera);
      out.camera_certificate = out.standing.at(db::CertificateKind::kCamera).certificate;
      out.camera_off = Millimetres(camera->value("left_out_rms_mm", 0.0));
    }
    if (const json* axes = in_force(db::CertificateKind::kAxes)) out.bed = bed_from_payload(*axes);
    // The board was burnt by the machine, whatever has become of the camera since.
    if (const Last& axes = found->at(db::CertificateKind::kAxes); axes.on_its_device)
      out.pattern = pattern_from_payload(axes.payload);
    if (const json* kerf = in_force(db::CertificateKind::kKerf))
      out.kerf = Millimetres(kerf->at("kerf_mm").get<double>());
    return out;
  } catch (const json::exception& e) {
    return unreadable(e);
  }
}

Result<Calibration> load_calibration(Repositories& r, const std::string& now) { return load(r, now, {}); }

Result<Calibration> load_calibration_of_run(Repositories& r, const std::string& now) {
  const auto run = r.jobs.last_run();
  if (!run) return run.error();
  if (!*run) return load(r, now, {});
  if ((*run)->ended_at) {
    const auto owed = r.jobs.unproven();
    if (!owed) return owed.error();
    if (!*owed) return load(r, now, {});
  }
  const auto facts = r.jobs.facts((*run)->id);
  if (!facts) return facts.error();
  return load(r, now, facts->certificates);
}

Result<bool> bed_frame_has_changed(Repositories& r, db::RunId run) {
  const auto facts = r.jobs.facts(run);
  if (!facts) return facts.error();
  for (const auto kind : {db::CertificateKind::kCamera, db::CertificateKind::kAxes}) {
    const auto last = r.certificates.last(kind);
    if (!last) return last.error();
    const auto& known = facts->certificates;
    if (*last && !known.empty() && std::ranges::find(known, (*last)->id) == known.end()) return true;
  }
  return false;
}

std::vector<std::string> doubts_of_payload(db::CertificateKind kind, const json& payload) {
  constexpr double kMostOff = 0.03;  // mm rms
  constexpr double kLeastCovered = 0.7;
  std::vector<std::string> out;
  if (!payload.is_object()) return out;
  if (kind == db::CertificateKind::kAxes) {
    constexpr double kMostBowed = 0.5;  // mm
    const double bowed = std::max(std::abs(payload.value("bow_x_mm", 0.0)), std::abs(payload.value("bow_y_mm", 0.0)));
    if (bowed > kMostBowed)
      out.push_back(
          fmt::format("the board it was burnt into is bowed by {:.1f} mm, so the bed's place is less sure: calibrate "
                      "the laser again with a flat board",
                      bowed));
  }
  if (kind != db::CertificateKind::kScanner) return out;
  if (payload.value("scans", 0) == 1)
    out.emplace_back(
        "it was made of one scan, so nothing tells how far off the next one will be: calibrate with two "
        "more, the sheet at other places (--more)");
  if (const double off = payload.value("other_scan_rms_mm", 0.0); off > kMostOff)
    out.push_back(
        fmt::format("a scan that it was made without lay off by {:.3f} mm rms, {:.3f} mm at worst: press the "
                    "sheet flat, and scan it at more places",
                    off, payload.value("other_scan_max_mm", 0.0)));
  if (const double covered = payload.value("covered_fraction", 1.0); covered < kLeastCovered)
    out.push_back(
        fmt::format("the sheet was seen on {:.0f} % of the glass, and beyond it the map is a guess: lay "
                    "panels there, or calibrate with the sheet moved to the other end as well",
                    covered * 100));
  return out;
}

Result<ErrorAt> error_at(const db::CertificateRecord& certificate, double x_mm, double y_mm) {
  try {
    const json payload = json::parse(certificate.payload);
    const auto kept = payload.find("predicted");
    if (kept == payload.end()) return ErrorAt{"", std::nullopt, why_not_predicted(certificate, payload)};
    const calib::ErrorLattice lattice = prediction_from_payload(payload);
    ErrorAt out{kept->at("frame").get<std::string>(), calib::predicted_error(lattice, x_mm, y_mm), ""};
    if (out.predicted) return out;
    // Whole ones within, so that none that is named is refused; and no -0.
    constexpr double kRounding = 1e-6;
    const auto from = [](double mm) { return std::ceil(mm - kRounding) + 0.0; };
    const auto to = [](double mm) { return std::floor(mm + kRounding) + 0.0; };
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("certificate {} tells nothing of the place {:g}, {:g}: name one from {:.0f}, {:.0f} to "
                             "{:.0f}, {:.0f} mm of the {}",
                             certificate.id.value, x_mm, y_mm, from(lattice.from_x_mm), from(lattice.from_y_mm),
                             to(lattice.to_x_mm()), to(lattice.to_y_mm()), out.frame)};
  } catch (const json::exception& e) {
    return unreadable(e);
  }
}

Result<std::vector<JudgedCertificate>> judged_certificates(Repositories& r, const std::string& now,
                                                           CertificateId before, int limit, const std::string& soon) {
  auto list = r.certificates.list(before, limit);
  if (!list) return list.error();
  try {
    const auto last = last_ones(r, now);
    if (!last) return last.error();
    std::vector<JudgedCertificate> out;
    for (auto& record : *list) {
      const CertificateStanding& standing = last->at(record.kind).standing;
      const CertificateState state = record.id == standing.certificate ? standing.state : CertificateState::kReplaced;
      const json payload = json::parse(record.payload, nullptr, false);
      std::vector<std::string> doubts;
      if (state == CertificateState::kValid) {
        doubts = doubts_of_payload(record.kind, payload);
        if (standing.expires_at <= soon)
          doubts.push_back(fmt::format("it expires on {}: calibrate again before then, so that no job has to wait",
                                       standing.expires_at.substr(0, 10)));
      }
      out.push_back({std::move(record), state, made_on(payload), std::move(doubts)});
    }
    return out;
  } catch (const json::exception& e) {
    return unreadable(e);
  }
}

Status require_scanner(const Calibration& calibration) {
  if (calibration.scanner) return Ok();
  return Error{
      ErrorCode::kRefused,
      "the scanner has no valid certificate: lay the AprilGrid sheet on it and run veneerctl calibrate scanner"};
}

Status require_cutting(const Calibration& calibration) {
  if (!calibration.camera)
    return Error{
        ErrorCode::kRefused,
        "the bed camera has no valid certificate: lay the AprilGrid sheet on the bed and run veneerctl calibrate "
        "camera"};
  if (!calibration.bed)
    return Error{
        ErrorCode::kRefused,
        "the machine's axes have no valid certificate: lay a bare board on the bed and run veneerctl calibrate "
        "laser"};
  if (!calibration.kerf)
    return Error{
        ErrorCode::kRefused,
        "the kerf has no valid certificate: lay the burnt board on the scanner and run veneerctl calibrate kerf"};
  return Ok();
}

Status require_picture_size(const calib::CameraModel& camera, int width_px, int height_px) {
  return require_size("bed camera", "camera", width_px, height_px, camera.parameters().width_px,
                      camera.parameters().height_px);
}

Status require_make(const Calibration& calibration, const std::string& make) {
  if (make.empty() || calibration.scanner_make.empty() || make == calibration.scanner_make) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format("this was scanned by a {}, but the scanner's certificate was made on a {}: connect that one, "
                  "or run veneerctl calibrate scanner",
                  make, calibration.scanner_make)};
}

Status require_scan_size(const Calibration& calibration, int columns, int rows) {
  if (!calibration.scan_size) return Ok();
  return require_size("scanner", "scanner", columns, rows, (*calibration.scan_size)[0], (*calibration.scan_size)[1]);
}

}  // namespace veneer::daemon
