// Masks that are painted in picture files, as the API takes them.
#include "cli/painted_mask.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/support/temp_directory.h"

namespace veneer::cli {
namespace {

std::string saved(const testing::TempDirectory& folder, const cv::Mat& picture, const char* name = "mask.png") {
  const std::string file = (folder / name).string();
  EXPECT_TRUE(cv::imwrite(file, picture));
  return file;
}

TEST(PaintedMask, SaysWhatMattersCellByCell) {
  const testing::TempDirectory folder;
  const cv::Mat picture = (cv::Mat_<std::uint8_t>(2, 3) << 255, 0, 128, 17, 34, 51);
  EXPECT_EQ(importance_from_picture(saved(folder, picture)).value(), "3x2:f08123");
}

TEST(PaintedMask, OfALargePictureIsCoarse) {
  const testing::TempDirectory folder;
  cv::Mat picture(1000, 480, CV_8UC3, cv::Scalar::all(0));
  picture.rowRange(500, 1000).setTo(cv::Scalar::all(255));
  EXPECT_EQ(importance_from_picture(saved(folder, picture)).value(),
            "23x48:" + std::string(23 * 24, '0') + std::string(23 * 24, 'f'));
  EXPECT_EQ(edges_from_picture(saved(folder, picture)).value(),
            "31x64:" + std::string(31 * 32 / 4, '0') + std::string(31 * 32 / 4, 'f'));
}

TEST(PaintedMask, PutsFourCellsOfEdgesInADigit) {
  const testing::TempDirectory folder;
  const cv::Mat picture = (cv::Mat_<std::uint8_t>(2, 3) << 255, 0, 200, 100, 0, 255);
  EXPECT_EQ(edges_from_picture(saved(folder, picture)).value(), "3x2:a4");
}

TEST(PaintedMask, SaysNothingWhereItIsTransparent) {
  const testing::TempDirectory folder;
  cv::Mat picture(1, 2, CV_8UC4, cv::Scalar(255, 255, 255, 255));
  EXPECT_EQ(importance_from_picture(saved(folder, picture)).value(), "2x1:ff");
  picture.at<cv::Vec4b>(0, 1)[3] = 128;
  const std::string file = saved(folder, picture);
  EXPECT_EQ(importance_from_picture(file).error().message,
            file + " is transparent in places: lay it on black or white, so that it says what they are");
}

TEST(PaintedMask, OfADeepPictureHasTheSameTones) {
  const testing::TempDirectory folder;
  const cv::Mat picture = (cv::Mat_<std::uint16_t>(1, 3) << 0x8080, 0x1111, 0xffff);
  EXPECT_EQ(importance_from_picture(saved(folder, picture)).value(), "3x1:81f");
}

TEST(PaintedMask, NamesTheFileThatIsNone) {
  const testing::TempDirectory folder;
  EXPECT_EQ(importance_from_picture("/nowhere/mask.png").error().message, "there is no file /nowhere/mask.png");
  const std::string photo = saved(folder, cv::Mat(8, 8, CV_8UC1, cv::Scalar(9)), "mask.jpg");
  EXPECT_EQ(edges_from_picture(photo).error().message, photo + " is no PNG picture: save the mask as one");
  const std::string whole = saved(folder, cv::Mat(64, 64, CV_8UC1, cv::Scalar(9)));
  std::filesystem::resize_file(whole, std::filesystem::file_size(whole) / 2);
  EXPECT_EQ(importance_from_picture(whole).error().message, whole + " is damaged: save the mask again");
}

}  // namespace
}  // namespace veneer::cli
