#include "daemon/devices/found_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <system_error>

#include "base/files.h"
#include "daemon/devices/usb_devices.h"

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

std::string usb_name(const fs::path& device) {
  if (device.empty()) return "";
  const std::string maker = told(device / "manufacturer"), product = told(device / "product");
  return maker.empty() || product.starts_with(maker) ? product : maker + " " + product;
}

// As udev writes it into names.
std::string in_names(std::string text) {
  constexpr std::string_view kAsIs = "#+-.:=@_/";
  std::ranges::replace_if(
      text,
      [&](char c) {
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        return !letter && kAsIs.find(c) == std::string_view::npos;
      },
      '_');
  return text;
}

// The first link in `folder` that leads to this port and whose name `is_meant`.
template <class IsMeant>
fs::path link_to(const fs::path& port, const fs::path& folder, const IsMeant& is_meant) {
  std::error_code none;
  for (const fs::path& link : entries_of(folder))
    if (is_meant(link.filename().string()) && fs::is_symlink(link, none) &&
        fs::weakly_canonical(link, none) == fs::weakly_canonical(port, none))
      return link;
  return {};
}

struct SerialChip {
  fs::path tty, usb;
  std::string serial;
};

// Many chips have none, and some makers print the same one into all of theirs, "0001" above all.
bool is_serial_number(const std::string& serial) {
  constexpr std::size_t kShortest = 6;
  return serial.size() >= kShortest && serial.find_first_not_of('0') != std::string::npos;
}

// `its_serial_alone`: no other port has that number, of another chip or of the same.
FoundLaser serial_port(const DeviceRoots& roots, const SerialChip& chip, bool its_serial_alone) {
  const fs::path port = roots.dev / chip.tty.filename();
  FoundLaser out{"grbl", "", usb_name(chip.usb), NamedBy::kNothing, ""};
  const std::string serial = in_names(chip.serial);
  fs::path name;
  // Of the shipped udev rules: "laser0" is counted, "laser-..." is the serial number, or the socket of a chip without.
  if (is_serial_number(chip.serial) && its_serial_alone) {
    name = link_to(port, roots.dev / "veneer", [&](const std::string& is) { return is == "laser-" + serial; });
    if (name.empty())
      name = link_to(port, roots.dev / "serial" / "by-id",
                     [&](const std::string& is) { return is.find("_" + serial + "-if") != std::string::npos; });
    if (!name.empty()) out.named_by = NamedBy::kSerialNumber;
  }
  if (name.empty()) {
    if (chip.serial.empty())
      name = link_to(port, roots.dev / "veneer", [](const std::string& is) { return is.starts_with("laser-"); });
    if (name.empty()) name = link_to(port, roots.dev / "serial" / "by-path", [](const std::string&) { return true; });
    if (!name.empty()) out.named_by = NamedBy::kSocket;
  }
  if (name.empty())
    out.refusal = fmt::format(
        "{} goes to another machine when that is plugged in first, and it has no other name: install the udev rules "
        "that come with veneerd, and plug it in again",
        port.string());
  out.port = fmt::format("serial:{}?baud=115200", (name.empty() ? port : name).string());
  return out;
}

std::vector<SerialChip> serial_chips(const DeviceRoots& roots) {
  std::vector<SerialChip> chips;
  for (const fs::path& tty : entries_of(roots.sys / "class" / "tty")) {
    const std::string name = tty.filename().string();
    if (!name.starts_with("ttyUSB") && !name.starts_with("ttyACM")) continue;
    const fs::path usb = usb_device_of(tty / "device");
    chips.push_back({tty, usb, usb.empty() ? "" : told(usb / "serial")});
  }
  return chips;
}

}  // namespace

std::vector<FoundLaser> find_lasers(const DeviceRoots& roots) {
  const std::vector<SerialChip> chips = serial_chips(roots);
  std::vector<FoundLaser> out;
  for (const SerialChip& chip : chips) {
    const auto alike = [&](const SerialChip& one) { return one.serial == chip.serial; };
    out.push_back(serial_port(roots, chip, std::ranges::count_if(chips, alike) == 1));
  }
  std::vector<FoundLaser> boards;
  for (const fs::path& device : entries_of(roots.sys / "bus" / "usb" / "devices"))
    if (told(device / "idVendor") == "1a86" && told(device / "idProduct") == "5512")
      boards.push_back({"lihuiyu", fmt::format("usb:1a86:5512@{}", device.filename().string()), usb_name(device),
                        NamedBy::kSocket, ""});
  for (FoundLaser& board : boards) {
    if (boards.size() > 1)
      board.refusal =
          "several boards of this kind are plugged in, and they have no serial numbers: leave only the laser's in";
    out.push_back(std::move(board));
  }
  return out;
}

Status means_one_machine(const DeviceRoots& roots, const LaserConfig& laser) {
  if (laser.set_by != SetBy::kChoice) return Ok();
  if (laser.kind == "lihuiyu") {
    const auto found = find_lasers(roots);
    const auto refused = std::ranges::find_if(
        found, [](const FoundLaser& one) { return one.kind == "lihuiyu" && !one.refusal.empty(); });
    return refused == found.end() ? Ok() : Status(Error{ErrorCode::kRefused, refused->refusal});
  }
  constexpr std::string_view kSerial = "serial:";
  const fs::path port = laser.port.substr(kSerial.size(), laser.port.find('?') - kSerial.size());
  std::error_code none;
  const fs::path leads_to = fs::weakly_canonical(port, none);
  const auto chips = serial_chips(roots);
  const auto there = std::ranges::find_if(
      chips, [&](const SerialChip& chip) { return fs::weakly_canonical(roots.dev / chip.tty.filename()) == leads_to; });
  if (there == chips.end() || !is_serial_number(there->serial)) return Ok();
  const bool by_number = port.filename().string().find(in_names(there->serial)) != std::string::npos;
  const auto alike = std::ranges::count(chips, there->serial, &SerialChip::serial);
  if (!by_number || alike == 1) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format(
          "{} ports that are plugged in have the laser's serial number {}, and {} leads to one of "
          "them, whichever it is: leave only the laser's in, or remove chosen_devices.toml, start, and choose it "
          "by its socket",
          alike, there->serial, port.string())};
}

std::vector<FoundCamera> find_cameras(const DeviceRoots& roots) {
  struct Node {
    fs::path path;
    std::string serial, index;
  };
  std::vector<Node> nodes;
  for (const fs::path& entry : entries_of(roots.sys / "class" / "video4linux")) {
    if (!entry.filename().string().starts_with("video")) continue;
    const fs::path usb = usb_device_of(entry / "device");
    nodes.push_back({entry, usb.empty() ? "" : told(usb / "serial"), told(entry / "index")});
  }
  std::vector<FoundCamera> out;
  for (const Node& node : nodes) {
    const fs::path port = roots.dev / node.path.filename();
    FoundCamera& found = out.emplace_back();
    found.node = port.string(), found.name = told(node.path / "name");
    found.is_first = node.index.empty() || node.index == "0";
    // Cameras with one number between them would each be the other after they were plugged in anew.
    const bool alone = std::ranges::count_if(nodes, [&](const Node& other) {
                         return other.serial == node.serial && other.index == node.index;
                       }) == 1;
    fs::path name;
    if (is_serial_number(node.serial) && alone)
      name = link_to(port, roots.dev / "v4l" / "by-id",
                     [&](const std::string& is) { return is.find(in_names(node.serial)) != std::string::npos; });
    if (!name.empty()) found.named_by = NamedBy::kSerialNumber;
    if (name.empty()) {
      name = link_to(port, roots.dev / "v4l" / "by-path", [](const std::string&) { return true; });
      if (!name.empty()) found.named_by = NamedBy::kSocket;
    }
    found.device = name.string();
  }
  return out;
}

Status means_one_camera(const DeviceRoots& roots, const CameraConfig& camera) {
  const fs::path name = camera.device;
  if (camera.kind != "v4l2" || name.parent_path().filename() != "by-id") return Ok();
  std::error_code none;
  const fs::path leads_to = fs::weakly_canonical(name, none);
  for (const FoundCamera& found : find_cameras(roots)) {
    if (fs::weakly_canonical(found.node, none) != leads_to || found.named_by == NamedBy::kSerialNumber) continue;
    return Error{ErrorCode::kRefused,
                 fmt::format("{} is any camera of that make, since this one has no serial number that no other has: "
                             "{}",
                             camera.device,
                             found.device.empty() ? "leave only this one in, and use its name below /dev/v4l/by-path"
                                                  : fmt::format("use \"{}\"", found.device))};
  }
  return Ok();
}

fs::path camera_folder(const fs::path& data_dir) {
  std::error_code none;
  const fs::path whole = fs::absolute(data_dir, none);
  return (none ? data_dir : whole.lexically_normal()) / "camera";
}

Status make_camera_folder(const fs::path& data_dir) {
  std::error_code failed;
  const fs::path folder = camera_folder(data_dir);
  if (fs::create_directories(folder, failed))
    fs::permissions(folder, fs::perms::group_write, fs::perm_options::add, failed);
  return failed ? cannot_write(folder) : Status(Ok());
}

std::vector<FoundPicture> find_camera_pictures(const fs::path& data_dir) {
  std::vector<FoundPicture> out;
  const auto now = fs::file_time_type::clock::now();
  for (const fs::path& file : entries_of(camera_folder(data_dir))) {
    const std::string name = file.string(), kind = file.extension().string();
    std::error_code none;
    const bool picture = kind == ".jpg" || kind == ".jpeg" || kind == ".png";
    // As a camera's, * and ? would mean several.
    const bool plain = std::ranges::all_of(name, [](char c) { return c >= ' ' && c <= '~' && c != '*' && c != '?'; });
    if (!picture || !plain || !fs::is_regular_file(file, none)) continue;
    const auto written = fs::last_write_time(file, none);
    if (none) continue;
    out.push_back({name, std::chrono::duration_cast<std::chrono::seconds>(now - written)});
  }
  return out;
}

}  // namespace veneer::daemon
