#include "planner/pictures/png_codec.h"

#include "planner/pictures/picture_limits.h"

#include <algorithm>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>
#include <vector>

#include <png.h>
#include <zlib.h>

namespace veneer::planner {
namespace {

void leave(png_structp png, png_const_charp /*why*/) { png_longjmp(png, 1); }
void say_nothing(png_structp /*png*/, png_const_charp /*what*/) {}

void take_bytes(png_structp png, png_bytep to, std::size_t count) {
  auto& rest = *static_cast<std::string_view*>(png_get_io_ptr(png));
  if (count > rest.size()) png_error(png, "cut short");
  std::memcpy(to, rest.data(), count);
  rest.remove_prefix(count);
}

void give_bytes(png_structp png, png_bytep from, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(from), count);
}
void flush_nothing(png_structp /*png*/) {}

void list_rows(const cv::Mat& picture, std::vector<png_bytep>& rows) {
  rows.resize(static_cast<std::size_t>(picture.rows));
  for (int r = 0; r < picture.rows; ++r) rows[static_cast<std::size_t>(r)] = const_cast<png_bytep>(picture.ptr(r));
}

// libpng reports errors by a jump. So nothing with a destructor may live in decode() and encode(). False: broken.
bool decode(png_structp png, png_infop info, std::string_view& bytes, cv::Mat& out, std::vector<png_bytep>& rows) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, &bytes, take_bytes);
  png_read_info(png, info);
  const std::uint32_t width = png_get_image_width(png, info), height = png_get_image_height(png, info);
  if (std::int64_t{width} * height > kMostPixels) return false;
  png_set_expand(png);  // palettes to colours, small depths to 8 bits, a transparent colour to alpha
  if (png_get_bit_depth(png, info) == 16) png_set_swap(png);
  png_set_bgr(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  const int depth = png_get_bit_depth(png, info) == 16 ? CV_16U : CV_8U;
  out.create(static_cast<int>(height), static_cast<int>(width), CV_MAKETYPE(depth, png_get_channels(png, info)));
  list_rows(out, rows);
  png_read_image(png, rows.data());
  png_read_end(png, nullptr);
  return true;
}

bool encode(png_structp png, png_infop info, const cv::Mat& picture, int depth, std::vector<png_bytep>& rows,
            std::string& out) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, &out, give_bytes, flush_nothing);
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, Z_RLE);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.cols), static_cast<png_uint_32>(picture.rows), depth,
               picture.channels() == 1   ? PNG_COLOR_TYPE_GRAY
               : picture.channels() == 4 ? PNG_COLOR_TYPE_RGB_ALPHA
                                         : PNG_COLOR_TYPE_RGB,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_set_packing(png);
  png_set_bgr(png);
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  return true;
}

}  // namespace

std::optional<cv::Mat> decode_png(std::string_view bytes) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, say_nothing);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  cv::Mat picture;
  std::vector<png_bytep> rows;
  const bool decoded = info != nullptr && decode(png, info, bytes, picture, rows);
  png_destroy_read_struct(&png, &info, nullptr);
  if (!decoded) return std::nullopt;
  return picture;
}

namespace {

// In 8 bits or, when all values are 0 and 1, in 1.
std::optional<std::string> encode_in(const cv::Mat& picture, int depth) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, say_nothing);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  std::string file;
  std::vector<png_bytep> rows;
  list_rows(picture, rows);
  const bool encoded = info != nullptr && encode(png, info, picture, depth, rows, file);
  png_destroy_write_struct(&png, &info);
  if (!encoded) return std::nullopt;
  return file;
}

}  // namespace

std::optional<std::string> encode_png(const cv::Mat& picture) {
  const int type = picture.type();
  if (picture.empty() || (type != CV_8UC3 && type != CV_8UC4 && type != CV_8UC1)) return std::nullopt;
  return encode_in(picture, 8);
}

std::optional<std::string> encode_png_mask(const cv::Mat& mask) {
  if (mask.empty() || mask.type() != CV_8UC1) return std::nullopt;
  return encode_in((mask != 0) & 1, 1);
}

}  // namespace veneer::planner
