// USB devices as the kernel tells of them, and which of them a worker that scans may open.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace veneer::daemon {

// Where the device on USB is plugged in that this part of it, below /sys, belongs to; "" when it belongs to none.
std::filesystem::path usb_device_of(const std::filesystem::path& part);

// The device files of all that are plugged in now but for lasers: Lihuiyu boards, and the adapter, or the controller
// itself, behind the laser's serial port. `laser_port` is LaserConfig::port ("serial:/dev/ttyUSB0?baud=115200"), by
// whatever name; `sys` is where the kernel tells of devices. Any thread.
std::vector<std::filesystem::path> usb_devices_but_lasers(const std::string& laser_port,
                                                          const std::filesystem::path& sys = "/sys");

}  // namespace veneer::daemon
