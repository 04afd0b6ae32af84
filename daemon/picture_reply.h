// Pictures on their way to people. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "daemon/api/api_message.h"

namespace veneer::daemon {

ApiReply png_reply(const cv::Mat& picture);

// The width a picture is wanted in, in pixels: `otherwise` when none is asked for or it is too small to see anything.
int shown_width(std::optional<double> asked, int otherwise);

}  // namespace veneer::daemon
