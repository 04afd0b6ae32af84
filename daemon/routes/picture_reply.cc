#include "daemon/routes/picture_reply.h"

#include <opencv2/imgproc.hpp>
#include <utility>

#include "planner/pictures/jpeg_codec.h"
#include "planner/pictures/png_codec.h"

namespace veneer::daemon {

namespace {

constexpr int kJpegQuality = 92;

std::optional<std::string> encode_as_jpeg(const cv::Mat& picture, planner::JpegColours colours) {
  if (picture.channels() == 3) return planner::encode_jpeg(picture, kJpegQuality, colours);
  cv::Mat coloured;
  cv::cvtColor(picture, coloured, cv::COLOR_GRAY2BGR);
  return planner::encode_jpeg(coloured, kJpegQuality, colours);
}

}  // namespace

const char* content_type_of(PictureFile file) { return file == PictureFile::kPng ? "image/png" : "image/jpeg"; }

ApiReply picture_reply(const cv::Mat& picture, PictureFile file, planner::JpegColours colours) {
  auto bytes = file == PictureFile::kPng ? planner::encode_png(picture) : encode_as_jpeg(picture, colours);
  if (!bytes) return ApiReply::error({ErrorCode::kInternal, "the picture could not be encoded"});
  return ApiReply::bytes(std::move(*bytes), content_type_of(file));
}

ApiReply png_reply(const cv::Mat& picture) {
  return picture_reply(picture, PictureFile::kPng, planner::JpegColours::kOfEachPixel);
}

PanelLibrary::MissingTiles missing_tiles(const db::PanelRecord& panel, Role asking) {
  return panel.retired && asking < Role::kOperator ? PanelLibrary::MissingTiles::kRefuse
                                                   : PanelLibrary::MissingTiles::kMake;
}

QueryPool::Making preview_answer(const PanelLibrary& library, const std::string& file,
                                 std::optional<std::int64_t> width) {
  return [&library, file, width](Repositories&) {
    if (!width) {
      auto bytes = library.load_bytes(file);
      return bytes ? ApiReply::bytes(std::move(*bytes), "image/png") : ApiReply::error(bytes.error());
    }
    const auto small = library.load_small(file, static_cast<int>(*width));
    return small ? png_reply(small->pixels) : ApiReply::error(small.error());
  };
}

}  // namespace veneer::daemon
