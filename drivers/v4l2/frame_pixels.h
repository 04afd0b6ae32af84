// From a frame's bytes to pixels. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/raw_picture.h"
#include "drivers/v4l2/frame_source.h"

namespace veneer::v4l2 {

// RGB of 8 bits; nothing when it is broken in any way. Given by whoever has a decoder that forgives nothing.
using DecodeJpeg = std::function<std::optional<RawPicture>(std::span<const std::uint8_t>)>;

// What can be read, the best first: what is not compressed loses nothing and cannot break off unseen.
const std::vector<std::string_view>& readable_formats();
bool is_compressed(std::string_view code);
// Of a whole frame; what is shorter lacks pixels. 0 of a compressed format. REQUIRES: a readable one.
std::size_t bytes_of_frame(const FrameFormat& format);
// RGB of 8 bits, without a margin; grey of "GREY" as RGB too, so that all frames are alike. Nothing when bytes are
// missing or the JPEG is broken or of another size. REQUIRES: a readable format.
std::optional<RawPicture> pixels_of(const FrameFormat& format, std::span<const std::uint8_t> bytes,
                                    const DecodeJpeg& decode_jpeg);

}  // namespace veneer::v4l2
