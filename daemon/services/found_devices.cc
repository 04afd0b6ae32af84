#include "daemon/services/found_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <system_error>

#include "base/files.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

// The names in a folder, in order; none when there is no such folder.
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code none;
  for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
    out.push_back(entry->path());
  std::ranges::sort(out);
  return out;
}

// One line that the kernel tells of a device.
std::string told(const fs::path& file) {
  std::string text = read_whole(file).value_or("");
  text.resize(std::min(text.find('\n'), text.size()));
  std::erase_if(text,
                [](char c) { return static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~'; });
  return text;
}

// The device on USB that this part of it belongs to.
fs::path usb_device_of(const fs::path& part) {
  std::error_code none;
  constexpr int kDepth = 6;
  fs::path at = fs::canonical(part, none);
  for (int i = 0; i < kDepth && !none && at.has_relative_path(); ++i, at = at.parent_path())
    if (fs::exists(at / "idVendor", none)) return at;
  return {};
}

std::string usb_name(const fs::path& device) {
  if (device.empty()) return "";
  const std::string maker = told(device / "manufacturer"), product = told(device / "product");
  return maker.empty() || product.starts_with(maker) ? product : maker + " " + product;
}

// The first link in `folder` that leads to this port and may stay when others are plugged in.
fs::path lasting_name(const fs::path& folder, std::string_view prefix, const fs::path& port) {
  std::error_code none;
  for (const fs::path& link : entries_of(folder))
    if (link.filename().string().starts_with(prefix) && fs::is_symlink(link, none) &&
        fs::weakly_canonical(link, none) == fs::weakly_canonical(port, none))
      return link;
  return {};
}

FoundLaser serial_port(const DeviceRoots& roots, const fs::path& tty) {
  const fs::path port = roots.dev / tty.filename();
  // Of the shipped udev rules: "laser0" is counted, "laser-..." is named by what is plugged in, or where.
  fs::path name = lasting_name(roots.dev / "veneer", "laser-", port);
  if (name.empty()) name = lasting_name(roots.dev / "serial" / "by-id", "", port);
  const bool lasting = !name.empty();
  return {"grbl", fmt::format("serial:{}?baud=115200", (lasting ? name : port).string()),
          usb_name(usb_device_of(tty / "device")), lasting};
}

}  // namespace

std::vector<FoundLaser> find_lasers(const DeviceRoots& roots) {
  std::vector<FoundLaser> out;
  for (const fs::path& tty : entries_of(roots.sys / "class" / "tty")) {
    const std::string name = tty.filename().string();
    if (name.starts_with("ttyUSB") || name.starts_with("ttyACM")) out.push_back(serial_port(roots, tty));
  }
  for (const fs::path& device : entries_of(roots.sys / "bus" / "usb" / "devices"))
    if (told(device / "idVendor") == "1a86" && told(device / "idProduct") == "5512")
      out.push_back({"lihuiyu", fmt::format("usb:1a86:5512@{}", device.filename().string()), usb_name(device), true});
  return out;
}

std::vector<FoundPicture> find_camera_pictures(const fs::path& data_dir) {
  std::vector<FoundPicture> out;
  const auto now = fs::file_time_type::clock::now();
  for (const fs::path& folder : {data_dir, data_dir / "camera"})
    for (const fs::path& file : entries_of(folder)) {
      const std::string name = file.filename().string(), kind = file.extension().string();
      std::error_code none;
      const bool picture = kind == ".jpg" || kind == ".jpeg" || kind == ".png";
      // As a camera's, * and ? would mean several.
      const bool plain = std::ranges::all_of(name, [](char c) { return c > ' ' && c <= '~' && c != '*' && c != '?'; });
      if (!picture || !plain || !fs::is_regular_file(file, none)) continue;
      const auto written = fs::last_write_time(file, none);
      if (none) continue;
      out.push_back({file.string(), std::chrono::duration_cast<std::chrono::seconds>(now - written)});
    }
  return out;
}

}  // namespace veneer::daemon
