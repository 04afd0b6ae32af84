#include "daemon/orders/kept_wood.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>

#include "daemon/orders/panel_wood.h"
#include "daemon/orders/stored_picture.h"
#include "planner/matching/index_cache.h"
#include "planner/pictures/resample.h"
#include "planner/suggest/picture_sketch.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

// A panel of 34 x 26 mm at 300 dpi, whose right quarter cannot be used.
class KeptWood : public ::testing::Test {
 protected:
  void SetUp() override {
    cv::Mat mask(306, 402, CV_8UC1, cv::Scalar(255));
    mask.colRange(301, 402) = 0;
    ASSERT_TRUE(write_stored_picture(planner::test::wood_picture(402, 306, 7), folder_ / "map-1.png").ok());
    ASSERT_TRUE(write_stored_picture(planner::test::wood_picture(402, 306, 8), folder_ / "map-2.png").ok());
    ASSERT_TRUE(write_stored_picture(mask, folder_ / "mask-1.png").ok());
    panel_.id = PanelId{"P-0001"};
    panel_.map = folder_ / "map-1.png", panel_.mask = folder_ / "mask-1.png";
  }
  // Counts what is decoded.
  WoodPictures counted() {
    const WoodPictures stored = stored_wood();
    return {[this, stored](const HeldPanel& panel) {
              ++maps_;
              return stored.map(panel);
            },
            [this, stored](const HeldPanel& panel, Millimetres margin) {
              ++masks_;
              return stored.free(panel, margin);
            }};
  }
  WoodPictures kept() { return kept_wood(folder_ / "index", counted()); }
  static Region<PanelFrame> square(double x, double y) {
    const auto at = [](double px, double py) { return point<PanelFrame>(px, py); };
    return Region<PanelFrame>(Ring<PanelFrame>{at(x, y), at(x + 5, y), at(x + 5, y + 5), at(x, y + 5)});
  }

  testing::TempDirectory folder_;
  HeldPanel panel_;
  int maps_ = 0, masks_ = 0;
};

TEST_F(KeptWood, IsDecodedOnceAndTheSameFromThenOn) {
  const auto first = kept().map(panel_), free = kept().free(panel_, 0.2_mm);
  ASSERT_TRUE(first.ok() && free.ok());
  const auto again = kept().map(panel_), free_again = kept().free(panel_, 0.2_mm);
  ASSERT_TRUE(again.ok() && free_again.ok());
  EXPECT_EQ(maps_, 1);
  EXPECT_EQ(masks_, 1);
  EXPECT_DOUBLE_EQ(again->resolution.dpi(), planner::kSketchDpi);
  EXPECT_EQ(first->pixels.size(), cv::Size(100, 76));
  EXPECT_EQ(cv::norm(first->pixels, again->pixels, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(free->pixels, free_again->pixels, cv::NORM_INF), 0);
}

TEST_F(KeptWood, IsMadeAnewWhenWhatIsFreeIsAnother) {
  ASSERT_TRUE(kept().map(panel_).ok() && kept().free(panel_, 0.2_mm).ok());
  panel_.live = {square(5, 5)};
  const auto booked = kept().free(panel_, 0.2_mm);
  ASSERT_TRUE(booked.ok());
  EXPECT_EQ(masks_, 2) << "somebody holds wood of it";
  const auto is_free = [&](double x, double y) {
    double column = 0, row = 0;
    booked->to_pixels(point<PanelFrame>(x, y), column, row);
    return booked->pixels.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column)) != 0;
  };
  EXPECT_FALSE(is_free(7, 7));
  EXPECT_TRUE(is_free(15, 15));
  ASSERT_TRUE(kept().free(panel_, 0.5_mm).ok());
  EXPECT_EQ(masks_, 3) << "another margin";
  panel_.live.clear();
  ASSERT_TRUE(kept().free(panel_, 0.5_mm).ok());
  EXPECT_EQ(masks_, 4) << "what was held is free again";
  EXPECT_EQ(maps_, 1) << "its picture is the same all the while";

  panel_.map = folder_ / "map-2.png";
  const auto other = kept().map(panel_);
  ASSERT_TRUE(other.ok());
  EXPECT_EQ(maps_, 2);
  const auto wanted = planner::at_resolution(*read_stored_raster(panel_.map), ScanResolution::from_dpi(75));
  EXPECT_EQ(cv::norm(other->pixels, wanted.pixels, cv::NORM_INF), 0);
}

TEST_F(KeptWood, IsNeverTooGenerous) {
  panel_.live = {square(5.1, 5.3)};
  const auto coarse = kept().free(panel_, 0.2_mm);
  const auto mask = read_stored_raster(panel_.mask);
  ASSERT_TRUE(coarse.ok() && mask.ok());
  const Raster<PanelFrame> fine = free_wood(*mask, panel_.live, 0.2_mm);
  int lost = 0;
  for (int r = 0; r < fine.pixels.rows; ++r) {
    for (int c = 0; c < fine.pixels.cols; ++c) {
      double column = 0, row = 0;
      coarse->to_pixels(fine.from_pixels(c + 0.5, r + 0.5), column, row);
      const bool within = column >= 0 && row >= 0 && column < coarse->pixels.cols && row < coarse->pixels.rows;
      const bool free = within && coarse->pixels.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column)) != 0;
      const bool really = fine.pixels.at<std::uint8_t>(r, c) != 0;
      ASSERT_FALSE(free && !really) << c << " " << r;
      lost += really && !free ? 1 : 0;
    }
  }
  EXPECT_LT(lost, cv::countNonZero(fine.pixels) / 10) << "nor much too narrow";
}

TEST_F(KeptWood, GoesWithThePanelsIndexes) {
  ASSERT_TRUE(kept().map(panel_).ok() && kept().free(panel_, 0.2_mm).ok());
  EXPECT_FALSE(std::filesystem::is_empty(folder_ / "index"));
  planner::IndexCache::open(folder_ / "index")->keep_only({"P-0002"});
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "index"));
  ASSERT_TRUE(kept().map(panel_).ok());
  EXPECT_EQ(maps_, 2);
}

}  // namespace
}  // namespace veneer::daemon
