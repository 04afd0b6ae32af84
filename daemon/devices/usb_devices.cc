#include "daemon/devices/usb_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
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

// The kernel's tty of the laser's serial port, by whatever name; "" where it is no serial port. Nothing where one is
// configured that nobody can point to now: its name comes later than the adapter, or not at all without a driver.
std::optional<fs::path> tty_of(const std::string& laser_port, const fs::path& sys) {
  constexpr std::string_view kSerial = "serial:";
  if (!laser_port.starts_with(kSerial)) return fs::path();
  std::error_code none;
  const fs::path port = fs::canonical(laser_port.substr(kSerial.size(), laser_port.find('?') - kSerial.size()), none);
  if (none) return std::nullopt;
  const fs::path tty = sys / "class/tty" / port.filename();
  return fs::exists(tty, none) ? std::optional(tty) : std::nullopt;
}

// What can switch off or reset whatever is plugged into it.
bool is_hub(const fs::path& device) { return word_in(device / "bDeviceClass") == "09"; }

// Those that the daemon may open (70-veneerd.rules).
bool is_lihuiyu_board(const fs::path& device) {
  return word_in(device / "idVendor") == "1a86" && word_in(device / "idProduct") == "5512";
}

// The chips of GRBL controllers (70-veneerd.rules), and whatever else the kernel has made a tty of.
bool is_serial_adapter(const fs::path& device, const fs::path& sys) {
  constexpr std::array<std::string_view, 9> kChips{"1a86:7523", "1a86:5523", "1a86:55d4", "0403:6001", "0403:6015",
                                                   "10c4:ea60", "2341:",     "2a03:",     "303a:"};
  const std::string chip = word_in(device / "idVendor") + ":" + word_in(device / "idProduct");
  if (std::ranges::any_of(kChips, [&](std::string_view one) { return chip.starts_with(one); })) return true;
  std::error_code none;
  for (const auto& tty : fs::directory_iterator(sys / "class/tty", none))
    if (usb_device_of(tty.path() / "device") == device) return true;
  return false;
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
  const std::optional<fs::path> tty = tty_of(laser_port, sys);
  const fs::path laser = tty && !tty->empty() ? usb_device_of(*tty / "device") : fs::path();
  for (const auto& device : fs::directory_iterator(sys / "bus/usb/devices", none)) {
    const fs::path place = fs::canonical(device.path(), none);
    const std::string bus = word_in(place / "busnum"), number = word_in(place / "devnum");
    if (bus.empty() || number.empty() || is_hub(place) || is_lihuiyu_board(place)) continue;
    if (!laser.empty() && place == laser) continue;
    if (!tty && is_serial_adapter(place, sys)) continue;
    out.push_back(fmt::format("/dev/bus/usb/{:0>3}/{:0>3}", bus, number));
  }
  return out;
}

}  // namespace veneer::daemon
