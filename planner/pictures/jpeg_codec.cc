#include "planner/pictures/jpeg_codec.h"

#include "planner/pictures/picture_limits.h"

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>

#include <jpeglib.h>

namespace veneer::planner {
namespace {

// libjpeg reports errors by a call that must not return.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf back;
};

void leave(j_common_ptr decoder) { std::longjmp(reinterpret_cast<JpegErrors*>(decoder->err)->back, 1); }
void say_nothing(j_common_ptr /*decoder*/) {}
// A warning: bytes are missing or make no sense, and it would go on with grey.
void leave_when_damaged(j_common_ptr decoder, int level) {
  if (level < 0) leave(decoder);
}

// Nothing with a destructor may live in here: longjmp would skip it. False: broken.
bool decode(std::string_view bytes, const cv::Size* only, jpeg_decompress_struct& decoder, JpegErrors& errors,
            cv::Mat& out, bool& inverted) {
  if (setjmp(errors.back) != 0) return false;
  jpeg_create_decompress(&decoder);
  jpeg_mem_src(&decoder, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&decoder, TRUE);
  if (static_cast<std::int64_t>(decoder.image_width) * decoder.image_height > kMostPixels) return false;
  if (only != nullptr && (static_cast<std::int64_t>(decoder.image_width) != only->width ||
                          static_cast<std::int64_t>(decoder.image_height) != only->height))
    return false;
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

// The same.
bool encode(const cv::Mat& picture, int quality, JpegColours colours, jpeg_compress_struct& encoder, JpegErrors& errors,
            unsigned char*& bytes, unsigned long& size) {
  if (setjmp(errors.back) != 0) return false;
  jpeg_create_compress(&encoder);
  jpeg_mem_dest(&encoder, &bytes, &size);
  encoder.image_width = static_cast<JDIMENSION>(picture.cols);
  encoder.image_height = static_cast<JDIMENSION>(picture.rows);
  encoder.input_components = 3;
  encoder.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, quality, TRUE);
  // Of brightness, against one of colour.
  const int samples = colours == JpegColours::kOfEachPixel ? 1 : 2;
  encoder.comp_info[0].h_samp_factor = encoder.comp_info[0].v_samp_factor = samples;
  jpeg_start_compress(&encoder, TRUE);
  while (encoder.next_scanline < encoder.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(picture.ptr(static_cast<int>(encoder.next_scanline)));
    jpeg_write_scanlines(&encoder, &row, 1);
  }
  jpeg_finish_compress(&encoder);
  return true;
}

}  // namespace

std::optional<cv::Mat> decode_jpeg(std::string_view bytes, std::optional<cv::Size> only) {
  jpeg_decompress_struct decoder{};
  JpegErrors errors{};
  decoder.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = leave;
  errors.manager.output_message = say_nothing;
  errors.manager.emit_message = leave_when_damaged;
  cv::Mat pixels;
  bool inverted = false;
  const bool decoded = decode(bytes, only ? &*only : nullptr, decoder, errors, pixels, inverted);
  jpeg_destroy_decompress(&decoder);
  if (!decoded) return std::nullopt;
  if (inverted) cv::bitwise_not(pixels, pixels);
  return pixels;
}

std::optional<std::string> encode_jpeg(const cv::Mat& picture, int quality, JpegColours colours) {
  if (picture.empty() || picture.type() != CV_8UC3) return std::nullopt;
  jpeg_compress_struct encoder{};
  JpegErrors errors{};
  encoder.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = leave;
  errors.manager.output_message = say_nothing;
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool encoded = encode(picture, quality, colours, encoder, errors, bytes, size);
  jpeg_destroy_compress(&encoder);
  std::optional<std::string> file;
  if (encoded) file.emplace(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  return file;
}

}  // namespace veneer::planner
