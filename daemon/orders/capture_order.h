// What a worker process is asked to do with scanners and cameras, and what it answers. Pure; the doing is
// capture_work.h's, so that whoever orders need not link SANE.
#pragma once

#include <string>
#include <vector>

#include "drivers/sane/scan_order.h"
#include "drivers/v4l2/camera_order.h"
#include "drivers/v4l2/proposed_settings.h"

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

// A look by which somebody can choose the camera and how it is set; for people it becomes kShownPicture, a JPEG, in the
// work's folder. Of the settings a size of 0 x 0 and a format of "" stand for the best that it has, and no options for
// what its own automatics come to.
struct TryCamera {
  static constexpr const char* kKind = "try_camera";
  std::string device;
  v4l2::CameraSettings settings;
  int frames = 1;  // averaged
};
struct CameraTried {
  v4l2::CameraSettings settings;  // with which it was taken
  std::vector<v4l2::LookDoubt> doubts;
};
inline constexpr const char* kShownPicture = "shown.jpg";

// What these cameras are and what can be set on them.
struct DescribeCameras {
  static constexpr const char* kKind = "describe_cameras";
  std::vector<std::string> devices;
};
struct CamerasDescribed {
  std::vector<v4l2::DescribedCamera> cameras;  // in the same order
};

}  // namespace veneer::daemon
