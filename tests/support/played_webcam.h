// A played camera with what a usual webcam can be set to: automatics of exposure, white balance and focus, each with
// the setting that it makes; that one counts only while its automatic is off.
#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "tests/support/played_camera.h"

namespace veneer::testing {

// For cameras whose frames are none.
inline std::optional<RawPicture> no_jpeg(std::span<const std::uint8_t>, int, int) { return std::nullopt; }

class PlayedWebcam final : public PlayedCamera {
 public:
  explicit PlayedWebcam(ManualClock& clock) : PlayedCamera(clock) {
    using Kind = v4l2::CameraControl::Kind;
    has = {
        {V4L2_CID_BRIGHTNESS, "brightness", Kind::kWhole, 0, 255, 1, 128, 77, true, true, {}},
        {V4L2_CID_AUTO_WHITE_BALANCE, "white_balance_automatic", Kind::kYesNo, 0, 1, 1, 1, 1, true, true, {}},
        {V4L2_CID_WHITE_BALANCE_TEMPERATURE,
         "white_balance_temperature",
         Kind::kWhole,
         2000,
         6500,
         10,
         4000,
         5120,
         false,
         true,
         {}},
        {V4L2_CID_EXPOSURE_AUTO,
         "auto_exposure",
         Kind::kChoice,
         0,
         3,
         1,
         3,
         3,
         true,
         true,
         {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}}},
        {V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_time_absolute", Kind::kWhole, 3, 2047, 1, 250, 333, false, true, {}},
        {V4L2_CID_FOCUS_ABSOLUTE, "focus_absolute", Kind::kWhole, 0, 250, 5, 0, 35, false, true, {}},
        {V4L2_CID_FOCUS_AUTO, "focus_automatic_continuous", Kind::kYesNo, 0, 1, 1, 1, 1, true, true, {}},
        {V4L2_CID_ZOOM_ABSOLUTE, "zoom_absolute", Kind::kWhole, 100, 500, 1, 100, 140, true, true, {}},
        {V4L2_CID_PRIVACY, "privacy", Kind::kYesNo, 0, 1, 1, 0, 0, true, false, {}},
    };
    // What an automatic sets cannot be set by hand until it is off.
    on_set = [this](const std::string&) {
      const auto follows = [this](const std::string& set, const std::string& automatic, std::int64_t off) {
        if (has_control(set) && has_control(automatic)) control(set).active = control(automatic).value == off;
      };
      follows("white_balance_temperature", "white_balance_automatic", 0);
      follows("exposure_time_absolute", "auto_exposure", 1);
      follows("focus_absolute", "focus_automatic_continuous", 0);
    };
  }
  v4l2::CameraControl& control(const std::string& of) {
    return *std::ranges::find(has, of, &v4l2::CameraControl::name);
  }
  bool has_control(const std::string& of) {
    return std::ranges::find(has, of, &v4l2::CameraControl::name) != has.end();
  }
};

}  // namespace veneer::testing
