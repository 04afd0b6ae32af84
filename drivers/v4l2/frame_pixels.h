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

// RGB of 8 bits; nothing when it is broken in any way, or not of this width and height, which is seen before any pixel
// of it is decoded: a few bytes may claim to be a picture that fills the memory. Given by whoever has a decoder that
// forgives nothing.
using DecodeJpeg = std::function<std::optional<RawPicture>(std::span<const std::uint8_t>, int width, int height)>;

// What can be read, the best first: what is not compressed loses nothing and cannot break off unseen.
const std::vector<std::string_view>& readable_formats();
bool is_compressed(std::string_view code);
// Does a line of it have room for its pixels? True of a compressed format with a size. What a driver says is checked by
// this before anything is read by it. REQUIRES: a readable format.
bool has_whole_lines(const FrameFormat& format);
// Of a whole frame; what is shorter lacks pixels. 0 of a compressed format. REQUIRES: a readable one, with whole lines.
std::size_t bytes_of_frame(const FrameFormat& format);
// RGB of 8 bits, without a margin; grey of "GREY" as RGB too, so that all frames are alike. Nothing when lines
// are too short, bytes are missing or the JPEG is broken or of another size. REQUIRES: a readable format.
std::optional<RawPicture> pixels_of(const FrameFormat& format, std::span<const std::uint8_t> bytes,
                                    const DecodeJpeg& decode_jpeg);

}  // namespace veneer::v4l2
