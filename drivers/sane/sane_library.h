// SANE, the programming interface of scanners, in the terms of this room. The only door of its library.
//
// A backend is foreign code that may hang, crash or write where it likes, so this runs in a process that may be killed
// (daemon/workers), never in the one that owns the laser. Threading: one library at a time in a process, used by one
// thread. What it needs of its surroundings: SANE's configuration, the devices, the network.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
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

class Ending;  // of calls that may never return

// An open scanner, closed with this object.
class OpenScanner final : public ScanSource {
 public:
  ~OpenScanner() override;
  OpenScanner(const OpenScanner&) = delete;
  OpenScanner& operator=(const OpenScanner&) = delete;

  const std::string& scanner() const override { return name_; }
  ScanStatus start() override;
  ScanStatus parameters(FrameParameters& out) override;
  ScanStatus read(std::span<std::uint8_t> room, std::size_t& got) override;
  void cancel() override;

  // All that can be set, in the device's order, as it stands now.
  std::vector<ScannerOption> options() const;
  // Sets what fitting_value() gave. kDeviceFault when the device refuses.
  Status set(const ScannerOption& option, const std::string& value);

 private:
  friend class SaneLibrary;
  OpenScanner(void* handle, std::string name, std::shared_ptr<Ending> ending);

  void* handle_;  // SANE's
  std::string name_;
  std::shared_ptr<Ending> ending_;
};

class SaneLibrary {
 public:
  // `config`: the folder of dll.conf and the backends' files; "": the system's.
  static Result<std::unique_ptr<SaneLibrary>> open(const std::filesystem::path& config);
  ~SaneLibrary();
  SaneLibrary(const SaneLibrary&) = delete;
  SaneLibrary& operator=(const SaneLibrary&) = delete;

  // Every backend looks for its devices; on the network that takes seconds.
  Result<std::vector<FoundScanner>> find();
  Result<std::unique_ptr<OpenScanner>> open_scanner(const std::string& name);

 private:
  SaneLibrary();
  std::shared_ptr<Ending> ending_;
};

}  // namespace veneer::sane
