// A camera by the kernel's own interface, Video4Linux 2. The only door to it.
//
// Neither OpenCV's VideoCapture nor libv4l2 stands between. The first tells neither a frame's time nor the driver's
// word that it is damaged, knows a handful of controls by numbers of its own, and loads some hundred libraries more.
// The second makes RGB of every format, but hands a frame that came short out as a whole one when several came short,
// and decodes a JPEG that breaks off to its end. What proves where wood lies must not be repaired unseen; the few
// formats that cameras of this kind have are read in frame_pixels.h.
//
// Drivers may hang in any call, so this runs in a process that may be killed (daemon/workers). Threading: one thread.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>

#include "base/result.h"
#include "drivers/v4l2/open_camera.h"

namespace veneer::v4l2 {

// `device`: a file in /dev, or a link to one. kUnavailable: it is not there, or may not be used, or others use it;
// kRefused: it is no camera that streams pictures in one plane.
Result<std::unique_ptr<OpenCamera>> open_camera(const std::filesystem::path& device);
// Why a device file could not be opened, with what to do: by errno; of one that may not be used, by the group that it
// belongs to ("" when that is not known) and whether its members may use it.
Error not_opened(const std::string& device, int why, const std::string& group, bool for_group);
// Whether a device file is for the members of its group: not where that is root's, to which nobody is added for it.
bool is_for_group(gid_t group, mode_t mode);

}  // namespace veneer::v4l2
