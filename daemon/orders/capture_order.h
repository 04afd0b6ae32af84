// What a worker process is asked to do with scanners and cameras, and what it answers. Pure; the doing is
// capture_work.h's, so that whoever orders need not link SANE.
#pragma once

#include <string>
#include <vector>

#include "drivers/sane/scan_order.h"
#include "drivers/v4l2/camera_order.h"

namespace veneer::daemon {

// One picture of what lies on the glass; it becomes kMadeCapture in the work's folder.
struct ScanGlass {
  static constexpr const char* kKind = "scan_glass";
  std::string sane_config;  // SANE's folder of settings; "": the system's
  sane::ScanSettings settings;
};
inline constexpr const char* kMadeCapture = "capture.pnm";

// Every scanner there is, with what can be set on it.
struct FindScanners {
  static constexpr const char* kKind = "find_scanners";
  std::string sane_config;
};
struct ScannersFound {
  std::vector<sane::DescribedScanner> scanners;
};

// One picture of a camera by Video4Linux; it becomes kMadePicture in the work's folder.
struct TakePicture {
  static constexpr const char* kKind = "take_picture";
  std::string device;  // a file in /dev
  v4l2::CameraSettings settings;
  int frames = 1;  // averaged
};
inline constexpr const char* kMadePicture = "picture.ppm";

// What these cameras are and what can be set on them.
struct DescribeCameras {
  static constexpr const char* kKind = "describe_cameras";
  std::vector<std::string> devices;
};
struct CamerasDescribed {
  std::vector<v4l2::DescribedCamera> cameras;  // in the same order
};

}  // namespace veneer::daemon
