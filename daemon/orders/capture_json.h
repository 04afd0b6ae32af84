// Scanners as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/capture_order.h"
#include "daemon/orders/shapes_json.h"

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

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanGlass, sane_config, settings)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FindScanners, sane_config)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScannersFound, scanners)

}  // namespace veneer::daemon
