// Scanners and cameras as JSON between the daemon and its worker processes, for the few sources that write or read it.
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

namespace veneer::v4l2 {

NLOHMANN_JSON_SERIALIZE_ENUM(CameraControl::Kind, {{CameraControl::Kind::kOther, "other"},
                                                   {CameraControl::Kind::kYesNo, "yes_no"},
                                                   {CameraControl::Kind::kWhole, "whole"},
                                                   {CameraControl::Kind::kChoice, "choice"}})
NLOHMANN_JSON_SERIALIZE_ENUM(LookDoubt, {{LookDoubt::kUnsettled, "unsettled"},
                                         {LookDoubt::kTooDark, "too_dark"},
                                         {LookDoubt::kTooBright, "too_bright"},
                                         {LookDoubt::kBlurred, "blurred"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CameraSettings, width, height, format, options)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TakenPicture, card, bus, format, width, height, averaged, refused)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(OfferedFormat, code, width, height, most_width, most_height, step_width, step_height)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CameraControl, id, name, kind, least, most, step, usual, value, active, settable,
                                   choices)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DescribedCamera, device, card, bus, formats, controls, problem)

}  // namespace veneer::v4l2

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanGlass, sane_config, settings)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FindScanners, sane_config)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScannersFound, scanners)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TakePicture, device, settings, frames)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TryCamera, device, settings, frames)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CameraTried, settings, doubts)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DescribeCameras, devices)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CamerasDescribed, cameras)

}  // namespace veneer::daemon
