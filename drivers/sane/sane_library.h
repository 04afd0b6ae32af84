// SANE, the programming interface of scanners, in the terms of this room. The only door of its library.
//
// A backend is foreign code that may hang, crash or write where it likes, so this runs in a process that may be killed
// (daemon/workers), never in the one that owns the laser. Threading: one library at a time in a process, used by one
// thread. What it needs of its surroundings: SANE's configuration, the devices, the network.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/sane/scan_reader.h"
#include "drivers/sane/scanner_option.h"

namespace veneer::sane {

struct FoundScanner {
  std::string name;           // for SANE, as in "epson2:libusb:001:004"; changes with the port it is plugged into
  std::string vendor, model;  // "" where the device was not found but opened by its name
  std::string type;           // "flatbed scanner"

  // What stays when it is plugged in elsewhere: "EPSON Perfection V39". SANE knows no serial number.
  std::string make() const { return vendor.empty() ? model : model.empty() ? vendor : vendor + " " + model; }
};

// An open scanner, closed with this object.
class OpenScanner : public FrameSource {
 public:
  // All that can be set, in the device's order, as it stands now.
  virtual std::vector<ScannerOption> options() const = 0;
  // Sets what fitting_value() gave. kDeviceFault when the device refuses.
  virtual Status set(const ScannerOption& option, const std::string& value) = 0;
};

class SaneLibrary {
 public:
  virtual ~SaneLibrary() = default;
  // `config`: the folder of dll.conf and the backends' files; "": the system's.
  static Result<std::unique_ptr<SaneLibrary>> open(const std::filesystem::path& config);
  // Every backend looks for its devices; on the network that takes seconds.
  virtual Result<std::vector<FoundScanner>> find() = 0;
  virtual Result<std::unique_ptr<OpenScanner>> open_scanner(const std::string& name) = 0;
};

}  // namespace veneer::sane
