#include "daemon/news/cell_alarms.h"

#include <fmt/format.h>

namespace veneer::daemon {
namespace {

const char* device_words(db::CertificateKind kind) {
  switch (kind) {
    case db::CertificateKind::kScanner:
      return "the scanner";
    case db::CertificateKind::kCamera:
      return "the bed camera";
    case db::CertificateKind::kAxes:
      return "the laser on the bed";
    case db::CertificateKind::kKerf:
      return "the width of a cut";
  }
  return "a device";
}

}  // namespace

std::string certificate_words(const CellNeeds::Certificate& certificate) {
  const char* device = device_words(certificate.kind);
  switch (certificate.state) {
    case CertificateState::kExpired:
      return fmt::format("the certificate of {} is too old: calibrate anew", device);
    case CertificateState::kOtherDevice:
      return fmt::format("the certificate of {} was made on another device, or before it was set otherwise", device);
    case CertificateState::kReplaced:
      return fmt::format("the certificate of {} went with that of the camera: calibrate anew", device);
    case CertificateState::kAhead:
      return fmt::format("the certificate of {} is dated later than this machine's clock", device);
    case CertificateState::kMissing:
      return fmt::format("{} was never calibrated", device);
    case CertificateState::kValid:
      break;
  }
  return {};
}

AlarmCondition failure_of(const TaskView& task) {
  const std::string why = task.error ? task.error->message : "nobody knows why";
  return {fmt::format("task {}", task.id), false, fmt::format("{}: {}", task.kind, why)};
}

std::vector<AlarmCondition> cell_alarms(const CellView& view, const LaserStatus& laser, const CellNeeds& needs) {
  std::vector<AlarmCondition> out;
  const auto add = [&](std::string key, bool urgent, std::string sentence) {
    if (!sentence.empty()) out.push_back({std::move(key), urgent, std::move(sentence)});
  };
  if (view.state == CellState::kAborting || view.state == CellState::kAborted)
    add("aborted", true, view.reason.empty() ? "the cell is aborted" : view.reason);
  if (view.state == CellState::kHeld && !view.hold_commanded) add("held", false, view.reason);
  if (!laser.connected) add("laser", true, laser.why_not_connected);
  add("beam", true, laser.refusal);
  if (!needs.database_busy.empty()) add("database", needs.database_damaged, needs.database_busy);
  add("backups", false, needs.backups_silent);
  if (needs.choice_lost)
    add("devices", true,
        "devices were chosen for this cell, and its data folder holds no chosen_devices.toml: what was chosen is "
        "simulated now. Choose it again, or put the file back, and restart");
  for (const CellNeeds::Certificate& one : needs.certificates)
    if (one.state != CertificateState::kMissing)  // the next thing to do
      add(fmt::format("certificate {}", db::to_string(one.kind)), false, certificate_words(one));
  // Whatever job is under way.
  for (const auto& [job, pieces] : needs.suspects) {
    add(fmt::format("suspect {}", job.value), false,
        pieces == 1 ? fmt::format("1 piece of job {} is suspect: look at it, and say what became of it", job.value)
                    : fmt::format("{} pieces of job {} are suspect: look at each, and say what became of it", pieces,
                                  job.value));
    out.back().count = pieces;
  }
  return out;
}

}  // namespace veneer::daemon
