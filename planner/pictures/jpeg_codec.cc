#include "planner/pictures/jpeg_codec.h"

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <opencv2/core.hpp>

#include <jpeglib.h>

namespace veneer::planner {
namespace {

constexpr std::int64_t kMostPixels = std::int64_t{1} << 30;  // as OpenCV

// libjpeg reports errors by a call that must not return.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf back;
};

void leave(j_common_ptr decoder) { std::longjmp(reinterpret_cast<JpegErrors*>(decoder->err)->back, 1); }
void say_nothing(j_common_ptr /*decoder*/) {}

// Nothing with a destructor may live in here: longjmp would skip it. False: broken.
bool decode(std::string_view bytes, jpeg_decompress_struct& decoder, JpegErrors& errors, cv::Mat& out, bool& inverted) {
  if (setjmp(errors.back) != 0) return false;
  jpeg_create_decompress(&decoder);
  jpeg_mem_src(&decoder, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&decoder, TRUE);
  if (static_cast<std::int64_t>(decoder.image_width) * decoder.image_height > kMostPixels) return false;
  const int channels = decoder.num_components == 4 ? 4 : decoder.num_components == 1 ? 1 : 3;
  decoder.out_color_space = channels == 4 ? JCS_CMYK : channels == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  jpeg_start_decompress(&decoder);
  out.create(static_cast<int>(decoder.output_height), static_cast<int>(decoder.output_width), CV_8UC(channels));
  while (decoder.output_scanline < decoder.output_height) {
    JSAMPROW row = out.ptr(static_cast<int>(decoder.output_scanline));
    jpeg_read_scanlines(&decoder, &row, 1);
  }
  inverted = channels == 4 && decoder.saw_Adobe_marker != 0;  // Adobe's programs store 255 for no ink; all follow
  return true;
}

}  // namespace

std::optional<cv::Mat> decode_jpeg(std::string_view bytes) {
  jpeg_decompress_struct decoder{};
  JpegErrors errors{};
  decoder.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = leave;
  errors.manager.output_message = say_nothing;
  cv::Mat pixels;
  bool inverted = false;
  const bool decoded = decode(bytes, decoder, errors, pixels, inverted);
  jpeg_destroy_decompress(&decoder);
  if (!decoded) return std::nullopt;
  if (inverted) cv::bitwise_not(pixels, pixels);
  return pixels;
}

}  // namespace veneer::planner
