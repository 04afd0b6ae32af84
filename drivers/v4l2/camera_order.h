// One look: at what size, set how, into which file; and what can be asked of a camera that is there.
//
// What is set is read back: a camera that takes another size than it was asked for is not used, because its calibration
// is of one size.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/v4l2/control_lock.h"
#include "drivers/v4l2/fixed_look.h"
#include "drivers/v4l2/open_camera.h"

namespace veneer::v4l2 {

struct CameraSettings {
  int width = 0, height = 0;
  std::string format;  // one of readable_formats() that the device offers at this size
  StatedControls options;
};

struct TakenPicture {
  std::string card, bus;
  std::string format;
  int width = 0, height = 0;
  int averaged = 0, refused = 0;  // frames
};

struct DescribedCamera {
  std::string device;  // a file in /dev
  std::string card, bus;
  std::vector<OfferedFormat> formats;
  std::vector<CameraControl> controls;
  std::string problem;  // why it has none
};

// Of what it offers the largest size up to 1920 x 1080, or else the smallest there is, in the best format that it has
// there; where a size or a format is wanted, the best with that. As wanted when it has none.
Result<CameraSettings> best_settings(OpenCamera& camera, const CameraSettings& wanted);
// kInvalidArgument, kRefused: it has no such pictures, or makes others of what it was asked for.
Result<FrameFormat> take_format(OpenCamera& camera, const CameraSettings& settings);
// See lock_controls() and take_look().
Result<AveragedPicture> take_locked_look(OpenCamera& camera, const CameraSettings& settings, const LookOptions& options,
                                         const Clock& clock, const DecodeJpeg& decode_jpeg,
                                         const std::stop_token& stop);
// The same with its picture into `file`, as PPM.
Result<TakenPicture> take_picture(OpenCamera& camera, const CameraSettings& settings, const std::filesystem::path& file,
                                  const LookOptions& options, const Clock& clock, const DecodeJpeg& decode_jpeg,
                                  const std::stop_token& stop);
DescribedCamera describe_camera(OpenCamera& camera);

}  // namespace veneer::v4l2
