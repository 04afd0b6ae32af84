#include "daemon/services/panel_library.h"

#include <gtest/gtest.h>

#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

class SmallPictures : public ::testing::Test {
 protected:
  std::string store(int columns, int rows, const cv::Scalar& colour) {
    auto stored = library_.store_picture(cv::Mat(rows, columns, CV_8UC3, colour), "panels", "map");
    return stored ? stored->file : std::string();
  }
  void lose(const std::string& file) { std::filesystem::remove(dir_.path() / file); }

  veneer::testing::TempDirectory dir_;
  PanelLibrary library_{dir_.path()};
};

TEST_F(SmallPictures, AreAsWideAsAskedForAndNeverLargerThanWhatIsStored) {
  const std::string file = store(300, 200, {10, 90, 200});
  auto small = library_.load_small(file, 120);
  ASSERT_TRUE(small);
  EXPECT_EQ(small->pixels.size(), cv::Size(120, 80));
  EXPECT_DOUBLE_EQ(small->scale, 0.4);
  EXPECT_EQ(small->pixels.at<cv::Vec3b>(40, 60), cv::Vec3b(10, 90, 200));
  auto whole = library_.load_small(file, 9000);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->pixels.size(), cv::Size(300, 200));
  EXPECT_DOUBLE_EQ(whole->scale, 1);
}

TEST_F(SmallPictures, OfAStripStillHaveARow) {
  auto small = library_.load_small(store(2000, 10, {1, 2, 3}), 16);
  ASSERT_TRUE(small);
  EXPECT_EQ(small->pixels.rows, 1);
}

TEST_F(SmallPictures, AreReadFromTheDiskOnce) {
  const std::string file = store(300, 200, {10, 90, 200});
  ASSERT_TRUE(library_.load_small(file, 120));
  lose(file);
  EXPECT_TRUE(library_.load_small(file, 120));
  const auto other = library_.load_small(file, 121);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kStorage);
}

TEST_F(SmallPictures, ThatNobodyAskedForLatelyAreForgotten) {
  const std::string first = store(1500, 1000, {1, 1, 1}), often = store(1500, 1000, {2, 2, 2});
  ASSERT_TRUE(library_.load_small(first, 1500));
  ASSERT_TRUE(library_.load_small(often, 1500));
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(library_.load_small(store(1500, 1000, {double(10 + i), 0, 0}), 1500));
    ASSERT_TRUE(library_.load_small(often, 1500));
  }
  lose(first);
  lose(often);
  EXPECT_TRUE(library_.load_small(often, 1500));
  EXPECT_FALSE(library_.load_small(first, 1500));
}

}  // namespace
}  // namespace veneer::daemon
