#include "daemon/devices/usb_devices.h"

#include <fmt/format.h>

#include <fstream>
#include <string_view>
#include <system_error>

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

std::string word_in(const fs::path& file) {
  std::string word;
  std::ifstream(file) >> word;
  return word;
}

// Of the adapter behind the laser's serial port; "" where there is none.
fs::path usb_device_at(const std::string& laser_port, const fs::path& sys) {
  constexpr std::string_view kSerial = "serial:";
  if (!laser_port.starts_with(kSerial)) return {};
  std::error_code none;
  const fs::path port = fs::canonical(laser_port.substr(kSerial.size(), laser_port.find('?') - kSerial.size()), none);
  return none ? fs::path() : usb_device_of(sys / "class/tty" / port.filename() / "device");
}

// Those that the daemon may open (70-veneerd.rules).
bool is_lihuiyu_board(const fs::path& device) {
  return word_in(device / "idVendor") == "1a86" && word_in(device / "idProduct") == "5512";
}

}  // namespace

fs::path usb_device_of(const fs::path& part) {
  std::error_code none;
  constexpr int kDepth = 6;
  fs::path at = fs::canonical(part, none);
  for (int i = 0; i < kDepth && !none && at.has_relative_path(); ++i, at = at.parent_path())
    if (fs::exists(at / "idVendor", none)) return at;
  return {};
}

std::vector<fs::path> usb_devices_but_lasers(const std::string& laser_port, const fs::path& sys) {
  std::vector<fs::path> out;
  std::error_code none;
  const fs::path laser = usb_device_at(laser_port, sys);
  for (const auto& device : fs::directory_iterator(sys / "bus/usb/devices", none)) {
    const std::string bus = word_in(device.path() / "busnum"), number = word_in(device.path() / "devnum");
    if (bus.empty() || number.empty() || is_lihuiyu_board(device.path())) continue;
    if (!laser.empty() && fs::canonical(device.path(), none) == laser) continue;
    out.push_back(fmt::format("/dev/bus/usb/{:0>3}/{:0>3}", bus, number));
  }
  return out;
}

}  // namespace veneer::daemon
