#include "daemon/routes/picture_reply.h"

#include <opencv2/imgcodecs.hpp>
#include <vector>

namespace veneer::daemon {

ApiReply png_reply(const cv::Mat& picture) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", picture, bytes, {cv::IMWRITE_PNG_COMPRESSION, 3}))
    return ApiReply::error({ErrorCode::kInternal, "the picture could not be encoded"});
  return ApiReply::bytes({bytes.begin(), bytes.end()}, "image/png");
}

}  // namespace veneer::daemon
