// What a worker process does with pictures of calibration sheets and boards: finds what is on them, and fits. Pure but
// for the pictures' files. Payloads are those of certificates (daemon/store/certificate_payload.h), without the
// device's name.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/calibration_pattern.h"
#include "base/frames.h"
#include "base/geometry.h"
#include "base/result.h"
#include "base/units.h"
#include "calib/camera_fit.h"
#include "calib/camera_model.h"
#include "calib/scanner_model.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

struct Fit {
  nlohmann::json payload;
  Millimetres rms{0};
};

// The AprilGrid sheet on the glass, and the scanner's map from all scans of it.
struct ReadGridScan {
  static constexpr const char* kKind = "read_grid_scan";
  std::string file;
  ScanResolution nominal;
};
Result<calib::GridScan> read_grid_scan(const ReadGridScan& order, const std::filesystem::path& folder,
                                       const TaskProgress& progress);
struct FitScanner {
  static constexpr const char* kKind = "fit_scanner";
  std::vector<calib::GridScan> scans;
};
Result<Fit> fit_scanner(const FitScanner& order, const std::filesystem::path& folder, const TaskProgress& progress);

// The AprilGrid sheet on the bed, `height` above it, and lens and place from all views of it.
struct ReadGridView {
  static constexpr const char* kKind = "read_grid_view";
  std::string file;
  Millimetres height{0};
};
struct GridViewRead {
  calib::GridView view;
  int width_px = 0, height_px = 0;
};
Result<GridViewRead> read_grid_view(const ReadGridView& order, const std::filesystem::path& folder,
                                    const TaskProgress& progress);
struct FitCamera {
  static constexpr const char* kKind = "fit_camera";
  std::vector<calib::GridView> views;
  int width_px = 0, height_px = 0;
};
Result<Fit> fit_camera(const FitCamera& order, const std::filesystem::path& folder, const TaskProgress& progress);

// The burnt pattern on the bed.
struct ReadPatternView {
  static constexpr const char* kKind = "read_pattern_view";
  std::string file;
  calib::CameraParameters camera;
  std::int64_t camera_certificate = 0;
  Millimetres camera_off{0};  // as the camera's certificate says
  Millimetres height{0};
  PatternLayout pattern;
  Box<MachineFrame> reach;  // of the beam; empty where it is not known
};
Result<Fit> read_pattern_view(const ReadPatternView& order, const std::filesystem::path& folder,
                              const TaskProgress& progress);

// The burnt board on the glass.
struct ReadPatternScan {
  static constexpr const char* kKind = "read_pattern_scan";
  std::string file;
  ScanResolution nominal;
  calib::ScannerModelData scanner;
  std::optional<std::array<int, 2>> scan_size;  // of the scanner's certificate
  PatternLayout pattern;
};
Result<Fit> read_pattern_scan(const ReadPatternScan& order, const std::filesystem::path& folder,
                              const TaskProgress& progress);

}  // namespace veneer::daemon
