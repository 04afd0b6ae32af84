// What a worker process is asked to do with scanners, and what it answers. Pure; the doing is capture_work.h's, so that
// whoever orders need not link SANE.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/orders/shapes_json.h"
#include "drivers/sane/scan_order.h"

namespace veneer::sane {

NLOHMANN_JSON_SERIALIZE_ENUM(ScannerOption::Kind, {{ScannerOption::Kind::kOther, "other"},
                                                   {ScannerOption::Kind::kYesNo, "yes_no"},
                                                   {ScannerOption::Kind::kWhole, "whole"},
                                                   {ScannerOption::Kind::kNumber, "number"},
                                                   {ScannerOption::Kind::kText, "text"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanSettings::Area, x, y, width, height)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanSettings, device, dpi, depth, mode, source, area, options)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScannedPicture, scanner, make, dpi, width, height, channels, bits)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FoundScanner, name, vendor, model, type)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(OptionRange, least, most, step)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScannerOption, name, title, unit, kind, active, settable, range, numbers, words,
                                   value)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DescribedScanner, found, options, problem)

}  // namespace veneer::sane

namespace veneer::daemon {

// One picture of what lies on the glass; it becomes kMadeCapture in the work's folder.
struct ScanGlass {
  static constexpr const char* kKind = "scan_glass";
  std::string sane_config;  // SANE's folder of settings; "": the system's
  sane::ScanSettings settings;
};
inline constexpr const char* kMadeCapture = "capture.pnm";

// Every scanner there is, with what can be set on it.
struct FindScanners {
  static constexpr const char* kKind = "find_scanners";
  std::string sane_config;
};
struct ScannersFound {
  std::vector<sane::DescribedScanner> scanners;
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanGlass, sane_config, settings)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FindScanners, sane_config)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScannersFound, scanners)

}  // namespace veneer::daemon
