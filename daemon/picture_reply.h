// Pictures on their way to people. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

// As PNG, made smaller when `width` is less than the picture's (and at least 16 pixels); never larger.
ApiReply png_reply(const cv::Mat& picture, std::optional<double> width);
// The same of a stored PNG, whose bytes go out as they are when they need not change. kStorage when it is no picture.
ApiReply png_reply(std::string stored, std::optional<double> width);

}  // namespace veneer::daemon
