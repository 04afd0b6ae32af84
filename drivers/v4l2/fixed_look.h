// From a camera that delivers frames to one picture of now, or none.
//
// A frame is used only when nothing speaks against it. Refused, and another one waited for, is a frame
//   - that the driver calls damaged, that lacks bytes or whose JPEG is broken;
//   - without a time, from before the look was asked for, from the future, or no younger than one before it;
//   - whose pixels are those of another frame of this look, a refused one too: a real sensor has noise, so the driver
//     repeats an old frame.
// Too many of those, or none in time, end the look with the reason. The first frames that are not refused are thrown
// away all the same, and all that were taken before the settings have settled, whenever they come; and since two go,
// the exposure of those that stay began after the look was asked for, whether the driver stamps its begin or its end.
//
// The clock by which frames are dated stands still while the computer is suspended: a frame from before would seem to
// be of now. A look in which that happened has no picture.
//
// What stays is averaged. Frames that differ by more than noise are not: something moved, or the light did, and the
// mean would show what never was. Then it begins anew with the newer one, a few times.
#pragma once

#include <chrono>
#include <functional>
#include <stop_token>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/raw_picture.h"
#include "drivers/v4l2/frame_pixels.h"
#include "drivers/v4l2/frame_source.h"

namespace veneer::v4l2 {

// For how long this machine has been suspended since it started, to a millisecond; the clock of frames stands still
// meanwhile. Any thread.
Duration time_suspended();

struct LookOptions {
  // Four halve the noise, and with it the scatter of a tag's corners; sixteen would quarter it, and take four times as
  // long, in which something may move.
  int frames = 4;
  // Thrown away: so many, and those that were taken so soon after the camera began.
  int settling_frames = 2;
  Duration settling = std::chrono::milliseconds(500);
  // The same where a motor was set going for the look: a lens takes a second from one end to the other.
  Duration motor_settling = std::chrono::seconds(2);
  Duration deadline = std::chrono::seconds(10);  // of the whole look
  int most_refused = 30;                         // frames
  int most_beginnings = 4;                       // of the average
  // Grey levels of a square (frame_average.h). Noise of a poor sensor makes some 5 in the worst of all squares, a shift
  // by a pixel along the black edge of a tag 9.
  double most_change = 8;
  // For how long the computer has been suspended since it started.
  std::function<Duration()> time_suspended = v4l2::time_suspended;
};

struct AveragedPicture {
  RawPicture picture;  // RGB, 8 bits
  int averaged = 0;
  int refused = 0;  // frames
};

// Ends the camera's frames on every way out. kUnavailable: no good frame in time, or the computer was suspended
// meanwhile; kDeviceFault: too many frames were refused; kRefused: the bed does not keep still; kCancelled after a stop
// request, seen between two frames; or the camera's own error.
Result<AveragedPicture> take_look(FrameSource& source, const FrameFormat& format, const LookOptions& options,
                                  const Clock& clock, const DecodeJpeg& decode_jpeg, const std::stop_token& stop);

}  // namespace veneer::v4l2
