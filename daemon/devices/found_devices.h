// What is plugged in and could be this cell's laser or camera, and pictures that could be its camera's. Looked up in
// /sys and /dev; nothing is opened, so that no machine notices.
//
// Any thread that may wait for a disk.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/config.h"

namespace veneer::daemon {

struct DeviceRoots {
  std::filesystem::path dev = "/dev", sys = "/sys";
};

// What of a port's name still means the same machine when something else is plugged in or the computer starts anew.
enum class NamedBy {
  kNothing,       // "ttyUSB0" goes to whatever is found first
  kSerialNumber,  // the device's own, that no other one which is plugged in has
  kSocket         // the socket it is plugged into; whatever is plugged in there is it
};

struct FoundLaser {
  std::string kind;  // grbl | lihuiyu
  std::string port;  // as laser.port takes it
  std::string name;  // what the chip calls itself; "" when it does not
  NamedBy named_by = NamedBy::kNothing;
  std::string refusal;  // why it cannot be chosen, with what to do; "" when it can
};
// Serial ports on USB and Lihuiyu boards, by their ports' names.
std::vector<FoundLaser> find_lasers(const DeviceRoots& roots);
// Whether the name by which this laser was chosen means one machine still: kRefused when several that are plugged in
// have its serial number, or are boards without one. One that is not plugged in means none, and one that was written
// into the configuration by hand is not asked about.
Status means_one_machine(const DeviceRoots& roots, const LaserConfig& laser);

struct FoundCamera {
  std::string node;    // "/dev/video0"
  std::string device;  // as camera.device takes it; "" when it has no name that lasts
  std::string name;    // what it calls itself; "" when it does not
  NamedBy named_by = NamedBy::kNothing;
  bool is_first = true;  // of the nodes that a device has
};
// Devices of Video4Linux, by their nodes' names.
std::vector<FoundCamera> find_cameras(const DeviceRoots& roots);

// Whether the name in the configuration means one camera: kRefused for one below /dev/v4l/by-id when the camera that it
// leads to has no serial number, or shares it with another one that is plugged in. Then any camera of that make would
// be it. One that is not plugged in means none.
Status means_one_camera(const DeviceRoots& roots, const CameraConfig& camera);

struct FoundPicture {
  std::string file;
  std::chrono::seconds age;  // since it was written
};
// By its whole path: the data folder's own folder for what a camera's program writes. Members of the daemon's group may
// write into it.
std::filesystem::path camera_folder(const std::filesystem::path& data_dir);
Status make_camera_folder(const std::filesystem::path& data_dir);
std::vector<FoundPicture> find_camera_pictures(const std::filesystem::path& data_dir);

}  // namespace veneer::daemon
