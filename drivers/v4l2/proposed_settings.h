// What to write for a camera where it hangs: its own automatics know better than any default how bright the bed is and
// how far away. They are let settle, what they came to is read, and a locked look is taken with it.
#pragma once

#include <stop_token>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/v4l2/camera_order.h"
#include "drivers/v4l2/fixed_look.h"
#include "drivers/v4l2/open_camera.h"

namespace veneer::v4l2 {

// What speaks against a look with proposed settings. A device may not tell what its automatics did; then the locked
// picture is not theirs.
enum class LookDoubt {
  kUnsettled,  // the automatics went on changing something until the end
  kTooDark,    // or much darker than the automatics had it
  kTooBright,  // parts are white, or it is much brighter than the automatics had it
  kBlurred     // less sharp than the automatics had it
};

struct SettleOptions {
  Duration least = std::chrono::seconds(2);  // so long a lens seeks
  Duration still = std::chrono::seconds(1);  // without a change of a setting by more than its step and 2 %
  Duration most = std::chrono::seconds(8);
  Duration between = std::chrono::milliseconds(200);  // two readings; asking a camera takes it time
};

struct ProposedSettings {
  CameraSettings settings;
  AveragedPicture look;
  std::vector<LookDoubt> doubts;
};

// Of `wanted` only size and format count. What the automatics of exposure, gain, white balance and focus came to stands
// in the options by the names that the device has for it, as far as it takes that from a program; an exposure is moved
// to the nearest multiple of 10 ms, since lamps flicker with the mains, unless it is far shorter. Errors as
// lock_controls() and take_look(): one with an automatic that cannot be switched off has no settings to propose.
Result<ProposedSettings> propose_settings(OpenCamera& camera, const CameraSettings& wanted, const SettleOptions& settle,
                                          const LookOptions& options, const Clock& clock, const DecodeJpeg& decode_jpeg,
                                          const std::stop_token& stop);
// A look with settings that somebody stated, and what of that can be doubted without the automatics' own picture.
Result<ProposedSettings> try_settings(OpenCamera& camera, const CameraSettings& stated, const LookOptions& options,
                                      const Clock& clock, const DecodeJpeg& decode_jpeg, const std::stop_token& stop);

}  // namespace veneer::v4l2
