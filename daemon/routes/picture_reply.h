// Pictures on their way to people. Thread-safe.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "daemon/api/api_message.h"
#include "daemon/records/query_pool.h"
#include "daemon/stock/panel_library.h"
#include "planner/pictures/jpeg_codec.h"

namespace veneer::daemon {

// PNG is exact. JPEG is for whoever looks on a screen: a picture of wood is drawn and encoded in a small part of the
// time, and several times smaller (docs/SCHEMA.md, "At size").
enum class PictureFile { kPng, kJpeg };
const char* content_type_of(PictureFile file);
// A CV_8UC3 picture (BGR) or a CV_8UC1 one; `colours` are of a JPEG.
ApiReply picture_reply(const cv::Mat& picture, PictureFile file, planner::JpegColours colours);
ApiReply png_reply(const cv::Mat& picture);

// Making tiles takes seconds and room on the disk: of a panel that is out of stock only an operator has them made.
PanelLibrary::MissingTiles missing_tiles(const db::PanelRecord& panel, Role asking);

// A stored preview as it is, or at most `width` wide, once the moment of the question is over.
QueryPool::Making preview_answer(const PanelLibrary& library, const std::string& file,
                                 std::optional<std::int64_t> width);

}  // namespace veneer::daemon
