#include "daemon/routes/picture_reply.h"

#include <utility>

#include "planner/pictures/png_codec.h"

namespace veneer::daemon {

ApiReply png_reply(const cv::Mat& picture) {
  auto bytes = planner::encode_png(picture);
  if (!bytes) return ApiReply::error({ErrorCode::kInternal, "the picture could not be encoded"});
  return ApiReply::bytes(std::move(*bytes), "image/png");
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
