#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "drivers/file/file_camera.h"
#include "drivers/file/file_scanner.h"
#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

using ::testing::HasSubstr;

class FileDevicesTest : public ::testing::Test {
 protected:
  std::string picture(const std::string& name, int grey) {
    auto file = (directory_.path() / name).string();
    EXPECT_TRUE(cv::imwrite(file, cv::Mat(8, 12, CV_8UC3, cv::Scalar::all(grey))));
    return file;
  }
  std::string folder() const { return directory_.path().string(); }

  testing::TempDirectory directory_;
};

int grey(const std::filesystem::path& file) { return cv::imread(file.string()).at<cv::Vec3b>(0, 0)[0]; }

TEST_F(FileDevicesTest, GiveThePicturesOfAFolderInOrderAndRoundAgain) {
  picture("b.png", 20);
  picture("a.png", 10);
  std::ofstream(folder() + "/notes.txt") << "not a picture";
  FileScanner scanner(folder());
  for (const int expected : {10, 20, 10}) {
    const auto scan = scanner.scan(ScanResolution::from_dpi(300), {}, {});
    ASSERT_TRUE(scan.ok());
    EXPECT_EQ(grey(scan->file), expected);
    EXPECT_DOUBLE_EQ(scan->nominal.dpi(), 300);
  }
}

TEST_F(FileDevicesTest, TakeAPatternOrOneFile) {
  picture("bed-1.png", 1);
  const auto bed_2 = picture("bed-2.png", 2);
  picture("other.png", 3);
  FileCamera camera(folder() + "/bed-*.png");
  EXPECT_EQ(grey(camera.capture().value()), 1);
  EXPECT_EQ(grey(camera.capture().value()), 2);
  EXPECT_EQ(grey(camera.capture().value()), 1);
  FileCamera one(bed_2);
  EXPECT_EQ(grey(one.capture().value()), 2);
  EXPECT_EQ(grey(one.capture().value()), 2);
  EXPECT_EQ(one.device(), "file:" + bed_2);
}

TEST_F(FileDevicesTest, ACameraTellsHowOldItsPictureIs) {
  const auto file = picture("bed.png", 5);
  const auto an_hour_ago = std::chrono::system_clock::now() - std::chrono::hours(1);
  std::filesystem::last_write_time(file, std::chrono::file_clock::from_sys(an_hour_ago));
  FileCamera camera(file);
  EXPECT_FALSE(camera.taken_at()) << "none was asked for yet";
  ASSERT_TRUE(camera.capture().ok());
  ASSERT_TRUE(camera.taken_at());
  EXPECT_LT(std::chrono::abs(*camera.taken_at() - an_hour_ago), std::chrono::seconds(1));
  picture("bed.png", 6);
  ASSERT_TRUE(camera.capture().ok());
  EXPECT_GT(*camera.taken_at(), an_hour_ago + std::chrono::minutes(59));
}

TEST_F(FileDevicesTest, ACameraThatIsWatchedGivesItsPicturesInTurnAllTheSame) {
  picture("bed-1.png", 1);
  picture("bed-2.png", 2);
  FileCamera camera(folder());
  EXPECT_EQ(grey(camera.glance({}).value()), 1);
  EXPECT_TRUE(camera.taken_at());
  EXPECT_EQ(grey(camera.glance({}).value()), 1);
  EXPECT_EQ(grey(camera.capture().value()), 1);
  EXPECT_EQ(grey(camera.glance({}).value()), 2);
  EXPECT_EQ(grey(camera.capture().value()), 2);
}

TEST_F(FileDevicesTest, SeeAPictureThatWasChangedMeanwhile) {
  const auto file = picture("bed.png", 5);
  FileCamera camera(file);
  EXPECT_EQ(grey(camera.capture().value()), 5);
  picture("bed.png", 6);
  EXPECT_EQ(grey(camera.capture().value()), 6);
}

TEST_F(FileDevicesTest, NameWhatIsMissing) {
  FileCamera nothing(folder() + "/none-*.png");
  EXPECT_EQ(nothing.capture().error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(nothing.capture().error().message, HasSubstr("none-*.png"));
}

TEST_F(FileDevicesTest, AreCancelledBeforeTheyBegin) {
  FileScanner scanner(picture("a.png", 1));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(scanner.scan(ScanResolution::from_dpi(300), {}, stop.get_token()).error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer
