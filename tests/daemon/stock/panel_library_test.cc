#include "daemon/stock/panel_library.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "daemon/orders/stored_picture.h"
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

// A map has a hundred million pixels: nothing decodes it whole after a start.
TEST_F(SmallPictures, OfUsualWidthsOutliveTheDaemon) {
  const std::string map = store(2000, 900, {10, 90, 200});
  cv::Mat wood(900, 2000, CV_8UC1, cv::Scalar(255));
  wood.at<std::uint8_t>(899, 300) = 0;
  db::PanelRecord panel;
  panel.mask_file = library_.store_picture(wood, "panels", "mask")->file;
  library_.make_small(map, panel.mask_file);
  const PanelLibrary next(dir_.path());
  const auto only_a_head_is_left = [&](const std::string& file) {
    std::filesystem::resize_file(dir_.path() / file, 40);
  };
  only_a_head_is_left(map), only_a_head_is_left(panel.mask_file);
  for (const int width : {640, 1600}) {
    const auto small = next.load_small(map, width);
    ASSERT_TRUE(small) << small.error().message;
    EXPECT_EQ(small->pixels.cols, width);
    EXPECT_DOUBLE_EQ(small->scale, width / 2000.0);
    EXPECT_EQ(small->pixels.at<cv::Vec3b>(7, 7), cv::Vec3b(10, 90, 200));
  }
  EXPECT_FALSE(next.load_small(map, 641));
  const auto mask = next.load_mask(panel);
  ASSERT_TRUE(mask) << mask.error().message;
  EXPECT_EQ(cv::norm(mask->pixels, wood, cv::NORM_INF), 0);
  EXPECT_EQ(mask->resolution.px_per_mm, kMapResolution.px_per_mm);
  lose(panel.mask_file);
  EXPECT_FALSE(next.load_mask(panel)) << "of a mask that is lost nothing can be planned";
}

// A mask from before these were kept.
TEST_F(SmallPictures, OfAMaskAreMadeWhenSomebodyAsks) {
  db::PanelRecord panel;
  panel.mask_file = library_.store_picture(cv::Mat(90, 201, CV_8UC1, cv::Scalar(7)), "panels", "mask")->file;
  ASSERT_TRUE(library_.load_mask(panel));
  std::filesystem::resize_file(dir_.path() / panel.mask_file, 40);
  const auto again = library_.load_mask(panel);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(cv::countNonZero(again->pixels == 255), 90 * 201);
  EXPECT_EQ(again->pixels.size(), cv::Size(201, 90));
}

TEST_F(SmallPictures, OfAMapThatWasReplacedAreRemoved) {
  const auto keep = [&](const char* panel) {
    const auto stored = library_.store_picture(cv::Mat(9, 2000, CV_8UC3), std::string("panels/") + panel, "map");
    EXPECT_TRUE(library_.load_small(stored->file, 640));
  };
  keep("P-0001"), keep("P-00011");
  const auto files = [&] {
    const std::filesystem::directory_iterator all(library_.small_dir());
    return std::distance(begin(all), end(all));
  };
  EXPECT_EQ(files(), 2);
  library_.drop_index(PanelId{"P-0001"});
  EXPECT_EQ(files(), 1);
}

TEST_F(SmallPictures, AMapIsInTilesWhenItEntersAndStaysSoWhenItsMaskIsPainted) {
  const std::string map = store(1300, 700, {10, 90, 200});
  const auto mask_of = [&](int grey) {
    return library_.store_picture(cv::Mat(700, 1300, CV_8UC1, cv::Scalar(grey)), "panels/P-0001", "mask")->file;
  };
  const std::string first = mask_of(255), painted = mask_of(254);
  library_.make_small(map, first);
  std::filesystem::resize_file(dir_.path() / map, 40);  // its head
  library_.drop_mask(PanelId{"P-0001"}, first);
  library_.make_small(map, painted);
  const PanelLibrary next(dir_.path());
  const auto levels = next.tile_levels(map);
  ASSERT_TRUE(levels) << levels.error().message;
  EXPECT_EQ(*levels, (std::vector<cv::Size>{{1300, 700}, {650, 350}, {325, 175}}));
  const auto tile = next.load_tile(map, 1, 0, 0);
  ASSERT_TRUE(tile) << tile.error().message;
  const cv::Mat shown = cv::imdecode(std::vector<char>(tile->begin(), tile->end()), cv::IMREAD_COLOR);
  ASSERT_EQ(shown.size(), cv::Size(512, 512));
  EXPECT_LE(cv::norm(shown.at<cv::Vec3b>(300, 300) - cv::Vec3b(10, 90, 200), cv::NORM_INF), 3);
  EXPECT_EQ(next.load_tile(map, 1, 9, 0).error().code, ErrorCode::kNotFound);
}

// One from before tiles were kept, or whose tiles somebody removed.
TEST_F(SmallPictures, AMapWithoutTilesGetsThemWhenSomebodyLooks) {
  const std::string map = store(600, 30, {10, 90, 200});
  EXPECT_TRUE(library_.load_tile(map, 0, 1, 0));
  lose(map);
  EXPECT_TRUE(library_.load_tile(map, 0, 0, 0));
  library_.remove(map);
  std::filesystem::remove_all(library_.small_dir());
  EXPECT_EQ(library_.load_tile(map, 0, 0, 0).error().code, ErrorCode::kStorage);
}

// A crowd that looks at one map after the other fills no disk.
TEST_F(SmallPictures, TilesThatNobodyLookedAtForTheLongestTimeGiveWay) {
  const std::string first = store(600, 30, {10, 90, 200}), second = store(600, 30, {90, 10, 200}),
                    third = store(600, 30, {200, 90, 10});
  ASSERT_TRUE(library_.load_tile(first, 0, 0, 0));
  const std::filesystem::directory_iterator kept(library_.small_dir());
  const PanelLibrary two(dir_.path(), kept->file_size() * 5 / 2);
  const auto is_kept = [&](const std::string& map) {
    return two.load_tile(map, 0, 0, 0, PanelLibrary::MissingTiles::kRefuse).ok();
  };
  ASSERT_TRUE(two.load_tile(second, 0, 0, 0));
  ASSERT_TRUE(is_kept(first) && is_kept(second));
  ASSERT_TRUE(is_kept(first)) << "looked at once more";
  ASSERT_TRUE(two.load_tile(third, 0, 0, 0));
  EXPECT_TRUE(is_kept(first));
  EXPECT_FALSE(is_kept(second));
  EXPECT_TRUE(is_kept(third));
}

// They give way to others' between a look for them and their opening, or a disk spoils them: what is there cannot be
// opened, or is none.
TEST_F(SmallPictures, TilesThatCannotBeReadAreMadeAgain) {
  const std::string map = store(600, 30, {10, 90, 200});
  ASSERT_TRUE(library_.tile_levels(map));
  const auto tiles = std::filesystem::directory_iterator(library_.small_dir())->path();
  const auto nobody_can_open = [&] { ASSERT_EQ(::mknod(tiles.c_str(), S_IFSOCK | 0600, 0), 0); };
  const auto holds_nothing = [&] { std::ofstream(tiles) << ""; };
  for (const std::function<void()>& spoil : {std::function<void()>(nobody_can_open), {holds_nothing}}) {
    std::filesystem::remove(tiles);
    spoil();
    EXPECT_EQ(library_.load_tile(map, 0, 0, 0, PanelLibrary::MissingTiles::kRefuse).error().code, ErrorCode::kRefused);
    const auto tile = library_.load_tile(map, 0, 0, 0);
    EXPECT_TRUE(tile) << tile.error().message;
    std::filesystem::remove(tiles);
    spoil();
    const auto levels = library_.tile_levels(map);
    EXPECT_TRUE(levels) << levels.error().message;
  }
}

TEST_F(SmallPictures, TilesAreNotMadeForWhoMayNotHaveThemMade) {
  const std::string map = store(600, 30, {10, 90, 200});
  const auto refused = library_.tile_levels(map, PanelLibrary::MissingTiles::kRefuse);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_TRUE(library_.tile_levels(map));
  EXPECT_TRUE(library_.tile_levels(map, PanelLibrary::MissingTiles::kRefuse)) << "they are there";
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

// A cell at rest takes no room for what somebody looked at in the morning.
TEST_F(SmallPictures, AreGivenUpWhenNobodyHasAskedForThem) {
  const std::string asked = store(1500, 1000, {1, 1, 1}), left = store(1500, 1000, {2, 2, 2});
  ASSERT_TRUE(library_.load_small(asked, 1500));
  ASSERT_TRUE(library_.load_small(left, 1500));
  lose(asked);
  lose(left);
  const auto between = std::chrono::steady_clock::now();
  EXPECT_FALSE(library_.forget_unasked(between - std::chrono::hours(1))) << "both are in use";
  while (std::chrono::steady_clock::now() == between) {
  }
  EXPECT_TRUE(library_.load_small(asked, 1500)) << "and so it was asked for later than the other";
  EXPECT_TRUE(library_.forget_unasked(between + std::chrono::nanoseconds(1)));
  EXPECT_TRUE(library_.load_small(asked, 1500)) << "people look at it";
  EXPECT_FALSE(library_.load_small(left, 1500));
  EXPECT_FALSE(library_.forget_unasked(between)) << "there is nothing more to give up";
}

// What a worker process has made is decoded by the daemon later on; the worker may have been taken over.
TEST(PanelLibraryAdopts, OnlyPlainPicturesOfASizeThatCanBe) {
  const testing::TempDirectory folder;
  const PanelLibrary library(folder.path());
  const auto made = [&](const std::string& name, const cv::Mat& picture, const std::string& ending) {
    std::vector<unsigned char> bytes;
    EXPECT_TRUE(cv::imencode(ending, picture, bytes));
    std::ofstream(folder / name, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return folder / name;
  };
  const cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(90));
  const auto good = library.adopt(made("good.png", grey, ".png"), "panels/P-0001", "mask");
  ASSERT_TRUE(good.ok()) << good.error().message;
  EXPECT_EQ(library.load_picture(good->file)->size(), grey.size());
  EXPECT_FALSE(library.adopt(made("tiff.png", grey, ".tiff"), "panels/P-0001", "mask").ok());
  EXPECT_FALSE(library.adopt(made("deep.png", cv::Mat(4, 4, CV_16UC1, cv::Scalar(9)), ".png"), "panels", "mask").ok());
  EXPECT_FALSE(library.adopt(folder / "none.png", "panels/P-0001", "mask").ok());
  made("behind.png", grey, ".png");
  std::filesystem::create_symlink(folder / "behind.png", folder / "link.png");
  EXPECT_FALSE(library.adopt(folder / "link.png", "panels/P-0001", "mask").ok());
  const auto claims = [&](int side) {  // a picture that says it is so large
    const auto byte = [side](int shift) { return static_cast<char>(static_cast<unsigned>(side) >> shift & 0xffU); };
    const std::string length{byte(24), byte(16), byte(8), byte(0)};
    std::ofstream(folder / "claims.png", std::ios::binary)
        << std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16) << length << length << std::string("\x08\0\0\0\0", 5)
        << std::string(100, 'x');
    return library.adopt(folder / "claims.png", "panels/P-0001", "map");
  };
  EXPECT_TRUE(claims(14'470).ok()) << "as much as 1500 x 1000 mm at 300 dpi";
  const auto larger = claims(14'600);
  ASSERT_FALSE(larger.ok());
  EXPECT_EQ(larger.error().message,
            "a picture of 14600 x 14600 pixels was made of this, and the cell keeps at most 212 million (a panel "
            "of 1500 x 1000 mm at 300 dpi has 209): take less wood, or a smaller artwork, at once");
  EXPECT_TRUE(library.adopt(folder / "claims.png", "scans", "back", kMostPixelsScanned).ok())
      << "nobody decodes it here";
  std::string huge = "\x89PNG\r\n\x1a\n";
  huge += std::string("\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\0\0\0\0", 21);
  std::ofstream(folder / "huge.png", std::ios::binary) << huge << std::string(100, 'x');
  EXPECT_FALSE(library.adopt(folder / "huge.png", "panels/P-0001", "mask").ok());
}

TEST(StoredPicture, WhatIsNoFileIsNamedAndNotThrown) {
  const veneer::testing::TempDirectory folder;
  for (const auto& file : {folder.path(), folder / "missing.png"}) {
    const auto picture = read_stored_picture(file);
    ASSERT_FALSE(picture.ok());
    EXPECT_EQ(picture.error().code, ErrorCode::kStorage);
  }
  std::ofstream(folder / "half.png") << "\x89PNG";
  EXPECT_EQ(read_stored_picture(folder / "half.png").error().code, ErrorCode::kStorage);
}

}  // namespace
}  // namespace veneer::daemon
