// Bytes of frames become the colours that the standards give them, or nothing.
#include "drivers/v4l2/frame_pixels.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace veneer::v4l2 {
namespace {

using ::testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;

std::optional<RawPicture> no_decoder(std::span<const std::uint8_t>, int, int) { return std::nullopt; }

// BT.601 and BT.709 as they are written, apart from the code under test.
Bytes as_written(double luma, double cb, double cr, bool full_range, bool high_definition) {
  const double y = full_range ? luma / 255 : (luma - 16) / 219;
  const double b = (cb - 128) / (full_range ? 255 : 224), r = (cr - 128) / (full_range ? 255 : 224);
  const double red = high_definition ? y + 1.5748 * r : y + 1.402 * r;
  const double green = high_definition ? y - 0.187324 * b - 0.468124 * r : y - 0.344136 * b - 0.714136 * r;
  const double blue = high_definition ? y + 1.8556 * b : y + 1.772 * b;
  Bytes out;
  for (const double channel : {red, green, blue})
    out.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(channel, 0.0, 1.0) * 255)));
  return out;
}

TEST(V4l2Pixels, BlackWhiteAndRedAreThemselves) {
  const FrameFormat format{"YUYV", 4, 1, 8};
  // Limited range: 16 is black, 235 white; then pure red of BT.601.
  const auto picture = pixels_of(format, Bytes{16, 128, 235, 128, 81, 90, 81, 240}, no_decoder);
  ASSERT_TRUE(picture.has_value());
  EXPECT_THAT(picture->samples, ElementsAre(0, 0, 0, 255, 255, 255, 254, 0, 0, 254, 0, 0));
}

RC_GTEST_PROP(V4l2Pixels, LumaAndChromaAreColoursOfTheirStandard, (bool full_range, bool high_definition)) {
  const auto some = [] { return *rc::gen::arbitrary<std::uint8_t>(); };
  const std::uint8_t first = some(), second = some(), cb = some(), cr = some();
  const Bytes yuyv{first, cb, second, cr}, uyvy{cb, first, cr, second};
  const auto a = pixels_of({"YUYV", 2, 1, 4, full_range, high_definition}, yuyv, no_decoder);
  const auto b = pixels_of({"UYVY", 2, 1, 4, full_range, high_definition}, uyvy, no_decoder);
  RC_ASSERT(a && b);
  RC_ASSERT(a->samples == b->samples);
  Bytes expected = as_written(first, cb, cr, full_range, high_definition);
  const Bytes behind = as_written(second, cb, cr, full_range, high_definition);
  expected.insert(expected.end(), behind.begin(), behind.end());
  for (std::size_t i = 0; i < 6; ++i) RC_ASSERT(std::abs(a->samples[i] - expected[i]) <= 1);
}

TEST(V4l2Pixels, PaddingAtTheEndOfLinesIsLeftOut) {
  EXPECT_THAT(
      pixels_of({"RGB3", 2, 2, 8}, Bytes{1, 2, 3, 4, 5, 6, 90, 91, 7, 8, 9, 10, 11, 12, 92, 93}, no_decoder)->samples,
      ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
  EXPECT_THAT(pixels_of({"BGR3", 1, 2, 4}, Bytes{1, 2, 3, 90, 4, 5, 6, 91}, no_decoder)->samples,
              ElementsAre(3, 2, 1, 6, 5, 4));
  EXPECT_THAT(pixels_of({"GREY", 1, 2, 2}, Bytes{7, 90, 8, 91}, no_decoder)->samples, ElementsAre(7, 7, 7, 8, 8, 8));
}

TEST(V4l2Pixels, TwoByTwoPixelsShareOneColourInNv12) {
  // 3 x 3: odd sides have a colour of their own at their ends. Luma 235 all over; one square is red-ish, three are not.
  const FrameFormat format{"NV12", 3, 3, 4};
  const Bytes bytes{235, 235, 235, 0, 235, 235, 235, 0, 235, 235, 235, 0, 128, 200, 128, 128, 128, 128, 128, 128};
  ASSERT_EQ(bytes_of_frame(format), bytes.size());
  const auto picture = pixels_of(format, bytes, no_decoder);
  ASSERT_TRUE(picture.has_value());
  const auto green = [&](int x, int y) { return picture->samples[(y * 3 + x) * 3 + 1]; };
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) EXPECT_EQ(green(x, y) < 255, x < 2 && y < 2) << x << ", " << y;
}

TEST(V4l2Pixels, WhatLacksAByteIsNothing) {
  for (const std::string code : {"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY"}) {
    const FrameFormat format{code, 4, 4, 12};
    const std::size_t whole = bytes_of_frame(format);
    EXPECT_TRUE(pixels_of(format, Bytes(whole), no_decoder).has_value()) << code;
    EXPECT_FALSE(pixels_of(format, Bytes(whole - 1), no_decoder).has_value()) << code;
  }
}

// What a driver says of its lines is not believed: it would be read behind the frame's end.
TEST(V4l2Pixels, LinesThatAreShorterThanTheirPixelsAreNothing) {
  const auto least = [](const std::string& code, int width) {
    const int even = (width + 1) / 2 * 2;
    return code == "YUYV" || code == "UYVY" ? even * 2 : code == "NV12" ? even : code == "GREY" ? width : width * 3;
  };
  for (const std::string code : {"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY"})
    for (const int width : {1, 4, 5}) {
      const int line = least(code, width);
      const Bytes bytes(1000);
      EXPECT_TRUE(pixels_of({code, width, 3, line}, bytes, no_decoder).has_value()) << code << width;
      for (const int shorter : {line - 1, 0, -1})
        EXPECT_FALSE(pixels_of({code, width, 3, shorter}, bytes, no_decoder).has_value())
            << code << " " << width << ": " << shorter;
    }
  EXPECT_FALSE(pixels_of({"GREY", -1, 3, 4}, Bytes(1000), no_decoder).has_value());
  EXPECT_FALSE(pixels_of({"GREY", 1, -3, 4}, Bytes(1000), no_decoder).has_value());
  constexpr int kMost = std::numeric_limits<int>::max();
  EXPECT_FALSE(pixels_of({"YUYV", kMost, 1, 4}, Bytes(1000), no_decoder).has_value()) << "four bytes too many for int";
  EXPECT_FALSE(pixels_of({"RGB3", kMost / 2, 1, 4}, Bytes(1000), no_decoder).has_value());
  EXPECT_FALSE(pixels_of({"NV12", 4, kMost, 4}, Bytes(1000), no_decoder).has_value()) << "half as many rows more";
}

TEST(V4l2Pixels, AJpegIsTakenOnlyWholeAndOfItsSize) {
  std::optional<RawPicture> decoded = RawPicture{2, 1, 3, 8, {1, 2, 3, 4, 5, 6}};
  std::pair<int, int> asked;
  const auto decode = [&](std::span<const std::uint8_t>, int width, int height) {
    asked = {width, height};
    return decoded;
  };
  EXPECT_EQ(pixels_of({"MJPG", 2, 1, 0}, Bytes{1}, decode)->samples, decoded->samples);
  EXPECT_EQ(asked, std::pair(2, 1)) << "the decoder does not know what to refuse before it begins";
  EXPECT_FALSE(pixels_of({"MJPG", 1, 2, 0}, Bytes{1}, decode).has_value());
  decoded.reset();
  EXPECT_FALSE(pixels_of({"MJPG", 2, 1, 0}, Bytes{1}, decode).has_value());
}

}  // namespace
}  // namespace veneer::v4l2
