// Pictures on their way to people. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

#include "daemon/api/api_message.h"

namespace veneer::daemon {

ApiReply png_reply(const cv::Mat& picture);

}  // namespace veneer::daemon
