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

ApiReply preview_reply(const PanelLibrary& library, const std::string& file, std::optional<std::int64_t> width) {
  if (!width) {
    auto bytes = library.load_bytes(file);
    return bytes ? ApiReply::bytes(std::move(*bytes), "image/png") : ApiReply::error(bytes.error());
  }
  const auto small = library.load_small(file, static_cast<int>(*width));
  return small ? png_reply(small->pixels) : ApiReply::error(small.error());
}

}  // namespace veneer::daemon
