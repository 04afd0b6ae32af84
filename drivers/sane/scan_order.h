// One scan: which scanner, set how, into which file; and what can be asked of all scanners that are there.
//
// What is set is read back: a scanner that takes another resolution than it was asked for is not used, because the
// scale of everything that is cut hangs on it.
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "drivers/sane/sane_library.h"
#include "drivers/sane/scan_reader.h"

namespace veneer::sane {

struct ScanSettings {
  std::string device;  // SANE's name of it, or its make ("EPSON Perfection V39"); "": the only one there is
  double dpi = 300;
  int depth = 8;       // bits of a colour: 8 or 16
  std::string mode;    // as the device calls it; "": its colour mode
  std::string source;  // the same; "": as the device has it
  struct Area {
    Millimetres x, y, width, height;  // from the corner where the device begins
  };
  std::optional<Area> area;  // none: all of the glass
  // The device's own settings by name, set in this order, after mode and depth, before resolution and area.
  std::vector<std::pair<std::string, std::string>> options;
};

struct ScannedPicture {
  std::string scanner;  // SANE's name
  std::string make;     // "" where only its name is known
  double dpi = 0;       // what the device says that it scanned at
  int width = 0, height = 0, channels = 0, bits = 0;
};

struct DescribedScanner {
  FoundScanner found;
  std::vector<ScannerOption> options;
  std::string problem;  // why it has none
};

// kUnavailable when it is not there, or kConflict when several are meant; each names what is there.
Result<FoundScanner> choose_scanner(const std::vector<FoundScanner>& there, const std::string& wanted);
// Picture into `file`; see read_scan() for the rest. `options` give its times only.
Result<ScannedPicture> scan_picture(SaneLibrary& library, const ScanSettings& settings,
                                    const std::filesystem::path& file, const ReadOptions& options,
                                    const ScanProgress& progress, const std::stop_token& stop);
// Each is opened to ask what can be set; one that does not open is listed with the reason.
Result<std::vector<DescribedScanner>> describe_scanners(SaneLibrary& library, const ScanProgress& progress,
                                                        const std::stop_token& stop);

}  // namespace veneer::sane
