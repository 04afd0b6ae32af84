#include "planner/pictures/tile_pyramid.h"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/pictures/jpeg_codec.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

// Smooth, so that JPEG keeps it, and nowhere twice the same.
cv::Mat slope(int columns, int rows) {
  cv::Mat picture(rows, columns, CV_8UC3);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      picture.at<cv::Vec3b>(r, c) = {cv::saturate_cast<std::uint8_t>(40 + c * 160 / columns), 110,
                                     cv::saturate_cast<std::uint8_t>(30 + r * 180 / rows)};
  return picture;
}

class TilePyramid : public ::testing::Test {
 protected:
  cv::Mat tile(int level, int column, int row) {
    const auto jpeg = read_pyramid_tile(file_, level, column, row);
    EXPECT_TRUE(jpeg) << jpeg.error().message;
    const auto picture = jpeg ? decode_jpeg(*jpeg) : std::nullopt;
    return picture.value_or(cv::Mat());
  }
  ErrorCode refusal(int level, int column, int row) {
    const auto jpeg = read_pyramid_tile(file_, level, column, row);
    EXPECT_FALSE(jpeg);
    return jpeg ? ErrorCode::kInternal : jpeg.error().code;
  }

  veneer::testing::TempDirectory dir_;
  std::filesystem::path file_ = dir_.path() / "small" / "map-tiles.tif";
};

TEST_F(TilePyramid, HasALevelForEachHalfDownToASingleTile) {
  ASSERT_TRUE(write_tile_pyramid(slope(1301, 700), file_).ok());
  const auto levels = read_pyramid_levels(file_);
  ASSERT_TRUE(levels) << levels.error().message;
  EXPECT_EQ(*levels, (std::vector<cv::Size>{{1301, 700}, {651, 350}, {326, 175}}));
}

TEST_F(TilePyramid, ShowsThePictureInItsTiles) {
  const cv::Mat picture = slope(1301, 700);
  ASSERT_TRUE(write_tile_pyramid(picture, file_).ok());
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 3; ++column) {
      const cv::Mat shown = tile(0, column, row);
      ASSERT_EQ(shown.size(), cv::Size(kTileSide, kTileSide));
      const cv::Rect box =
          cv::Rect(column * kTileSide, row * kTileSide, kTileSide, kTileSide) & cv::Rect({}, picture.size());
      EXPECT_LE(cv::norm(shown(cv::Rect({}, box.size())), picture(box), cv::NORM_INF), 4) << column << ", " << row;
    }
  // Beyond the border its last pixel goes on.
  EXPECT_LE(cv::norm(tile(0, 2, 0).at<cv::Vec3b>(100, kTileSide - 1) - picture.at<cv::Vec3b>(100, 1300)), 6);
}

TEST_F(TilePyramid, MeansTheSamePlaceAtEveryLevel) {
  const cv::Mat picture = slope(1301, 700);
  ASSERT_TRUE(write_tile_pyramid(picture, file_).ok());
  for (const int level : {1, 2}) {
    const int fold = 1 << level;
    const cv::Mat shown = tile(level, 0, 0);
    for (const cv::Point p : {cv::Point(3, 5), {160, 90}, {320, 170}}) {
      const cv::Rect covered(p.x * fold, p.y * fold, fold, fold);
      const cv::Scalar mean = cv::mean(picture(covered & cv::Rect({}, picture.size())));
      const auto pixel = shown.at<cv::Vec3b>(p);
      for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(pixel[channel], mean[channel], 3) << level << p;
    }
  }
}

// Another program's reader: OpenCV's, by libtiff's own decoder.
TEST_F(TilePyramid, IsATiffThatOthersRead) {
  const cv::Mat picture = slope(1301, 700);
  ASSERT_TRUE(write_tile_pyramid(picture, file_).ok());
  std::vector<cv::Mat> pages;
  ASSERT_TRUE(cv::imreadmulti(file_.string(), pages, cv::IMREAD_COLOR));
  ASSERT_EQ(pages.size(), 3U);
  ASSERT_EQ(pages[0].size(), picture.size());
  EXPECT_LE(cv::norm(pages[0], picture, cv::NORM_INF), 6);
}

TEST_F(TilePyramid, OfASmallPictureIsOneTile) {
  ASSERT_TRUE(write_tile_pyramid(slope(40, 512), file_).ok());
  EXPECT_EQ(*read_pyramid_levels(file_), (std::vector<cv::Size>{{40, 512}}));
  EXPECT_EQ(tile(0, 0, 0).size(), cv::Size(kTileSide, kTileSide));
}

TEST_F(TilePyramid, OfAGreyPictureIsGrey) {
  ASSERT_TRUE(write_tile_pyramid(cv::Mat(600, 300, CV_8UC1, cv::Scalar(93)), file_).ok());
  EXPECT_LE(cv::norm(tile(0, 0, 1), cv::Mat(kTileSide, kTileSide, CV_8UC3, cv::Scalar::all(93)), cv::NORM_INF), 1);
}

TEST_F(TilePyramid, HasNoTileBesideThePicture) {
  ASSERT_TRUE(write_tile_pyramid(slope(1301, 700), file_).ok());
  constexpr int kBeside[][3] = {{0, 3, 0}, {0, 0, 2}, {1, 2, 0}, {3, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {70'000, 0, 0}};
  for (const auto& [level, column, row] : kBeside)
    EXPECT_EQ(refusal(level, column, row), ErrorCode::kNotFound) << level << ' ' << column << ' ' << row;
}

TEST_F(TilePyramid, ThatIsBrokenOffIsRefused) {
  ASSERT_TRUE(write_tile_pyramid(slope(1301, 700), file_).ok());
  const auto size = std::filesystem::file_size(file_);
  for (const auto left : {size / 2, size / 10, std::uintmax_t{4}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(file_, left);
    EXPECT_FALSE(read_pyramid_levels(file_)) << left;
    EXPECT_EQ(refusal(0, 2, 1), ErrorCode::kStorage) << left;
  }
}

TEST_F(TilePyramid, IsNotThereByHalves) {
  std::ofstream(dir_.path() / "small") << "a file where the folder should be";
  EXPECT_EQ(write_tile_pyramid(slope(600, 20), file_).error().code, ErrorCode::kStorage);
  EXPECT_EQ(write_tile_pyramid(cv::Mat(), dir_.path() / "a.tif").error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "a.tif"));
}

}  // namespace
}  // namespace veneer::planner
