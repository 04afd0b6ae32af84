#include "daemon/picture_reply.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::daemon {
namespace {

constexpr double kSmallestWidth = 16;

bool shrinks(const cv::Mat& picture, const std::optional<double>& width) {
  return width && *width >= kSmallestWidth && *width < picture.cols;
}

}  // namespace

ApiReply png_reply(const cv::Mat& picture, std::optional<double> width) {
  cv::Mat shown = picture;
  if (shrinks(picture, width))
    cv::resize(picture, shown,
               {static_cast<int>(*width), std::max(1, static_cast<int>(picture.rows * *width / picture.cols))}, 0, 0,
               cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", shown, bytes, {cv::IMWRITE_PNG_COMPRESSION, 3}))
    return ApiReply::error({ErrorCode::kInternal, "the picture could not be encoded"});
  return ApiReply::bytes({bytes.begin(), bytes.end()}, "image/png");
}

ApiReply png_reply(std::string stored, std::optional<double> width) {
  if (!width) return ApiReply::bytes(std::move(stored), "image/png");
  const cv::Mat bytes(1, static_cast<int>(stored.size()), CV_8UC1, stored.data());
  const cv::Mat picture = stored.empty() ? cv::Mat() : cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  if (picture.empty())
    return ApiReply::error({ErrorCode::kStorage, "the stored picture cannot be read: restore it from a backup"});
  if (!shrinks(picture, width)) return ApiReply::bytes(std::move(stored), "image/png");
  return png_reply(picture, width);
}

}  // namespace veneer::daemon
