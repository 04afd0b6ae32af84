#include "daemon/devices/sane_scanner.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <vector>

#include "daemon/devices/usb_devices.h"
#include "daemon/orders/capture_json.h"
#include "daemon/orders/have_done.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

// For the carriage to go home.
constexpr std::chrono::seconds kGrace{10};

WorkOrder order_of(const char* kind, const char* what, const WorkFolder& folder, const ScannerConfig& config,
                   const std::string& laser_port, std::chrono::milliseconds deadline) {
  WorkOrder order;
  order.kind = kind;
  order.what = what;
  order.folder = folder.path();
  order.readable = {config.sane_config.empty() ? fs::path("/etc/sane.d") : config.sane_config};
  // Files that a setting names: firmware, or a picture to be served.
  for (const auto& [name, value] : config.options)
    if (value.starts_with('/')) order.readable.emplace_back(value);
  order.devices = usb_devices_but_lasers(laser_port);
  order.network = true;
  order.deadline = deadline;
  order.grace = kGrace;
  order.nice = 0;  // a scanner that waits for its reader moves its carriage back and forth
  return order;
}

sane::ScanSettings settings_of(const ScannerConfig& config, double dpi) {
  sane::ScanSettings out;
  out.device = config.device;
  out.dpi = dpi;
  out.depth = config.depth;
  out.mode = config.mode;
  out.source = config.source;
  if (config.area_mm.size() == 4)
    out.area = sane::ScanSettings::Area{Millimetres(config.area_mm[0]), Millimetres(config.area_mm[1]),
                                        Millimetres(config.area_mm[2]), Millimetres(config.area_mm[3])};
  out.options = config.options;
  return out;
}

Error hangs(const std::string& device, std::chrono::milliseconds deadline) {
  return {
      ErrorCode::kTimeout,
      fmt::format("the scanner{} was not done within {} s and was given up: switch it off and on and scan again, or "
                  "allow more time with scan_limit_s in [workers] of the configuration",
                  device.empty() ? "" : " " + device, std::chrono::duration<double>(deadline).count())};
}

}  // namespace

SaneScanner::SaneScanner(std::unique_ptr<WorkRunner> workers, ScannerConfig config, std::string laser_port,
                         fs::path data_dir, std::chrono::milliseconds deadline)
    : workers_(std::move(workers)),
      config_(std::move(config)),
      laser_port_(std::move(laser_port)),
      data_dir_(std::move(data_dir)),
      deadline_(deadline) {}

Result<ScanFile> SaneScanner::scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) {
  folder_.reset();  // first, for it may be large
  auto folder = WorkFolder::make(data_dir_);
  if (!folder) return folder.error();
  // In hundredths: 300 from px/mm and back is 300.00000000000006.
  const double dpi = std::round(resolution.dpi() * 100) / 100;
  const auto tell = [&](double fraction, const std::string& doing) {
    if (progress) progress(fraction, doing);
  };
  const auto scanned = have_done<sane::ScannedPicture>(
      *workers_, order_of(ScanGlass::kKind, "scanning", *folder, config_, laser_port_, deadline_),
      ScanGlass{config_.sane_config.string(), settings_of(config_, dpi)}, tell, stop);
  if (!scanned) return scanned.error().code == ErrorCode::kTimeout ? hangs(config_.device, deadline_) : scanned.error();
  std::error_code none;
  if (scanned->dpi != dpi || !fs::is_regular_file(folder->path() / kMadeCapture, none))
    return Error{ErrorCode::kInternal,
                 "the scan came back with another resolution or without a picture: scan again, and report it when it "
                 "comes back"};
  tell(1, "");
  folder_ = std::move(*folder);
  return ScanFile{folder_->path() / kMadeCapture, ScanResolution::from_dpi(dpi), "sane:" + scanned->scanner,
                  scanned->make};
}

std::string SaneScanner::device() const {
  std::string text = "sane " + (config_.device.empty() ? "scanner" : config_.device);
  if (!config_.source.empty()) text += ", " + config_.source;
  if (config_.area_mm.size() == 4) text += fmt::format(", from {:g}, {:g} mm", config_.area_mm[0], config_.area_mm[1]);
  return text;
}

Result<ScannersFound> find_scanners(WorkRunner& workers, const Config& config, const TaskProgress& progress,
                                    const std::stop_token& stop) {
  const auto folder = WorkFolder::make(config.store.data_dir);
  if (!folder) return folder.error();
  return have_done<ScannersFound>(workers,
                                  order_of(FindScanners::kKind, "looking for scanners", *folder, config.scanner,
                                           config.laser.port, std::chrono::seconds(config.workers.look_limit_s)),
                                  FindScanners{config.scanner.sane_config.string()}, progress, stop);
}

}  // namespace veneer::daemon
