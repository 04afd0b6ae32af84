// JPEG and PNG against OpenCV's codecs, to the bit; PNG kinds that those do not keep apart, against what was written.
#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include <png.h>

#include "planner/pictures/jpeg_codec.h"
#include "planner/pictures/png_codec.h"

namespace veneer::planner {
namespace {

cv::Mat noise(int type) {
  cv::Mat picture(37, 53, type);
  cv::theRNG().state = 7;
  cv::randu(picture, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  return picture;
}

std::string as_file(const cv::Mat& picture, const std::string& extension) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, picture, bytes);
  return {bytes.begin(), bytes.end()};
}

void expect_same(const cv::Mat& got, const cv::Mat& expected) {
  ASSERT_EQ(got.type(), expected.type());
  ASSERT_EQ(got.size(), expected.size());
  EXPECT_EQ(cv::norm(got, expected, cv::NORM_INF), 0);
}

// `rows` are as they stand in the file, big-endian. The palette has four colours, of which the second is transparent.
std::string png_of(int width, int height, int bits, int colour_type, int interlace, std::vector<std::uint8_t> rows) {
  std::string file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &file,
      [](png_structp p, png_bytep from, std::size_t n) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(from), n);
      },
      [](png_structp) {});
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits, colour_type,
               interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  const std::vector<png_color> palette{{10, 20, 30}, {40, 50, 60}, {70, 80, 90}, {200, 210, 220}};
  std::vector<std::uint8_t> opaque{255, 0};
  if (colour_type == PNG_COLOR_TYPE_PALETTE) {
    png_set_PLTE(png, info, palette.data(), 4);
    png_set_tRNS(png, info, opaque.data(), 2, nullptr);
  }
  png_write_info(png, info);
  const std::size_t stride = rows.size() / static_cast<std::size_t>(height);
  std::vector<png_bytep> lines;
  for (int r = 0; r < height; ++r) lines.push_back(rows.data() + static_cast<std::size_t>(r) * stride);
  png_set_interlace_handling(png);
  png_write_image(png, lines.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return file;
}

TEST(Codecs, PngAsOpenCvReadsIt) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4}) {
    const cv::Mat picture = noise(type);
    const auto decoded = decode_png(as_file(picture, ".png"));
    ASSERT_TRUE(decoded) << type;
    expect_same(*decoded, picture);
  }
}

TEST(Codecs, PngAsOpenCvWritesIt) {
  const cv::Mat picture = noise(CV_8UC3);
  const auto file = encode_png(picture(cv::Rect(5, 4, 31, 20)));
  ASSERT_TRUE(file);
  expect_same(cv::imdecode(std::vector<std::uint8_t>(file->begin(), file->end()), cv::IMREAD_UNCHANGED),
              picture(cv::Rect(5, 4, 31, 20)));
  const auto grey = encode_png(noise(CV_8UC1));
  ASSERT_TRUE(grey);
  expect_same(cv::imdecode(std::vector<std::uint8_t>(grey->begin(), grey->end()), cv::IMREAD_UNCHANGED),
              noise(CV_8UC1));
  const auto clear = encode_png(noise(CV_8UC4));
  ASSERT_TRUE(clear);
  expect_same(cv::imdecode(std::vector<std::uint8_t>(clear->begin(), clear->end()), cv::IMREAD_UNCHANGED),
              noise(CV_8UC4));
  EXPECT_FALSE(encode_png(noise(CV_16UC3)));
  EXPECT_FALSE(encode_png({}));
}

TEST(Codecs, JpegAsOpenCvReadsIt) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    const std::string file = as_file(noise(type), ".jpg");
    const auto decoded = decode_jpeg(file);
    ASSERT_TRUE(decoded) << type;
    expect_same(*decoded, cv::imdecode(std::vector<std::uint8_t>(file.begin(), file.end()), cv::IMREAD_UNCHANGED));
  }
}

TEST(Codecs, AJpegOfAnotherSizeThanWantedIsNone) {
  const cv::Mat picture = noise(CV_8UC3);
  const std::string file = as_file(picture, ".jpg");
  EXPECT_TRUE(decode_jpeg(file, picture.size()));
  EXPECT_FALSE(decode_jpeg(file, picture.size() + cv::Size(1, 0)));
  EXPECT_FALSE(decode_jpeg(file, picture.size() + cv::Size(0, 1)));
}

TEST(Codecs, PalettesBecomeColoursWithTheirTransparency) {
  // Two bits a pixel: 0 1 2 3, 3 2 1 0.
  const auto decoded = decode_png(png_of(4, 2, 2, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, {0x1B, 0xE4}));
  ASSERT_TRUE(decoded);
  ASSERT_EQ(decoded->type(), CV_8UC4);
  EXPECT_EQ(decoded->at<cv::Vec4b>(0, 0), cv::Vec4b(30, 20, 10, 255));
  EXPECT_EQ(decoded->at<cv::Vec4b>(0, 1), cv::Vec4b(60, 50, 40, 0));
  EXPECT_EQ(decoded->at<cv::Vec4b>(1, 0), cv::Vec4b(220, 210, 200, 255));
}

TEST(Codecs, GreyWithAlphaKeepsItsAlpha) {
  const auto decoded = decode_png(png_of(2, 1, 16, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_INTERLACE_NONE,
                                         {0x12, 0x34, 0xFF, 0xFF, 0x56, 0x78, 0x00, 0x01}));
  ASSERT_TRUE(decoded);
  ASSERT_EQ(decoded->type(), CV_16UC2);
  EXPECT_EQ(decoded->at<cv::Vec2w>(0, 0), cv::Vec2w(0x1234, 0xFFFF));
  EXPECT_EQ(decoded->at<cv::Vec2w>(0, 1), cv::Vec2w(0x5678, 0x0001));
}

TEST(Codecs, InterlacedPicturesAreWhole) {
  std::vector<std::uint8_t> rows(9 * 7 * 3);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<std::uint8_t>(i);
  const auto decoded = decode_png(png_of(9, 7, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7, rows));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->at<cv::Vec3b>(6, 8), cv::Vec3b(188, 187, 186));
  EXPECT_EQ(decoded->at<cv::Vec3b>(3, 4), cv::Vec3b(95, 94, 93));
}

TEST(Codecs, BrokenFilesAreNone) {
  const std::string png = as_file(noise(CV_8UC3), ".png");
  for (std::size_t length = 0; length < png.size(); length += 101) EXPECT_FALSE(decode_png(png.substr(0, length)));
  std::string changed = png;
  changed[png.size() / 2] ^= 1;
  EXPECT_FALSE(decode_png(changed));
  EXPECT_FALSE(decode_jpeg(as_file(noise(CV_8UC3), ".jpg").substr(0, 300)));
  EXPECT_FALSE(decode_jpeg("nothing of the kind"));
}

}  // namespace
}  // namespace veneer::planner
