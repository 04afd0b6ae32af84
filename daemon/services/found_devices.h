// What is plugged in and could be this cell's laser, and pictures that could be its camera's. Looked up in /sys and
// /dev; nothing is opened, so that no machine notices.
//
// Any thread that may wait for a disk.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace veneer::daemon {

struct DeviceRoots {
  std::filesystem::path dev = "/dev", sys = "/sys";
};

struct FoundLaser {
  std::string kind;  // grbl | lihuiyu
  std::string port;  // as laser.port takes it
  std::string name;  // what the chip calls itself; "" when it does not
  bool lasting;      // the name of its port stays when something else is plugged in or the machine starts anew
};
// Serial ports on USB and Lihuiyu boards, by their ports' names.
std::vector<FoundLaser> find_lasers(const DeviceRoots& roots);

struct FoundPicture {
  std::string file;
  std::chrono::seconds age;  // since it was written
};
// In the data folder, and in its folder "camera": where a program may put what a camera sees.
std::vector<FoundPicture> find_camera_pictures(const std::filesystem::path& data_dir);

}  // namespace veneer::daemon
