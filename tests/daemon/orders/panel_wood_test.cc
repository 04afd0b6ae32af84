#include "daemon/orders/panel_wood.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

// 100 x 60 mm at one pixel a millimetre, all of one tone; its right half cannot be used.
struct Scene {
  Raster<PanelFrame> map{cv::Mat(60, 100, CV_8UC3, cv::Scalar(60, 90, 120)), {1.0}, {}};
  cv::Mat mask = cv::Mat(60, 100, CV_8UC1, cv::Scalar(255));
  std::vector<db::AllocationRecord> live;
  Scene() { mask.colRange(50, 100) = 0; }

  void allocate(double x, double y, db::AllocationState state) {
    db::AllocationRecord record;
    record.state = state;
    record.area = Region<PanelFrame>(
        Ring<PanelFrame>{corner(x, y), corner(x + 10, y), corner(x + 10, y + 10), corner(x, y + 10)});
    live.push_back(record);
  }
  static Point<PanelFrame> corner(double x, double y) { return {Millimetres(x), Millimetres(y)}; }
  // At a place in millimetres from the lower left corner.
  static cv::Vec3b at(const cv::Mat& picture, double x, double y) {
    return picture.at<cv::Vec3b>(static_cast<int>(60 - y), static_cast<int>(x));
  }
};

TEST(DrawStock, TellsFreeReservedCutAndUnusableWoodApart) {
  Scene scene;
  scene.allocate(10, 10, db::AllocationState::kReserved);
  scene.allocate(30, 10, db::AllocationState::kCut);
  scene.allocate(10, 40, db::AllocationState::kSuspect);
  const cv::Mat picture = draw_stock(scene.map, scene.mask, scene.live);
  EXPECT_EQ(Scene::at(picture, 35, 45), cv::Vec3b(60, 90, 120)) << "free wood has its own colours";
  const cv::Vec3b reserved = Scene::at(picture, 15, 15), cut = Scene::at(picture, 35, 15),
                  suspect = Scene::at(picture, 15, 45), unusable = Scene::at(picture, 75, 30);
  EXPECT_GT(reserved[0], reserved[2] + 50) << "blue";
  EXPECT_GT(suspect[2], suspect[0] + 100) << "orange";
  EXPECT_GT(std::min({cut[0], cut[1], cut[2]}), 175) << "white";
  EXPECT_GT(unusable[0], 150) << "pale";
  EXPECT_GT(picture.rows, 60) << "a legend below";
}

// Each piece is laid over the part of the picture that holds it, which has other pieces and free wood in it, too.
TEST(DrawStock, ColoursNoMoreThanAPieceHolds) {
  Scene scene;
  scene.allocate(0, 0, db::AllocationState::kReserved);
  scene.live.front().area =
      Region<PanelFrame>(Ring<PanelFrame>{Scene::corner(5, 5), Scene::corner(35, 5), Scene::corner(35, 10),
                                          Scene::corner(10, 10), Scene::corner(10, 35), Scene::corner(5, 35)});
  scene.allocate(15, 15, db::AllocationState::kSuspect);
  scene.allocate(-5, 45, db::AllocationState::kReserved);  // half of it beyond the map
  scene.allocate(300, 20, db::AllocationState::kReserved);
  const cv::Mat picture = draw_stock(scene.map, scene.mask, scene.live);
  const cv::Vec3b wood(60, 90, 120), in_its_arm = Scene::at(picture, 7, 30), suspect = Scene::at(picture, 20, 20);
  const auto is_blue = [](const cv::Vec3b& pixel) { return pixel[0] > pixel[2] + 50; };
  EXPECT_TRUE(is_blue(in_its_arm));
  EXPECT_TRUE(is_blue(Scene::at(picture, 30, 7)));
  EXPECT_GT(suspect[2], suspect[0] + 100) << "orange, not under the colour of the piece around it";
  EXPECT_EQ(Scene::at(picture, 30, 30), wood) << "free, in the corner of the piece around it";
  EXPECT_EQ(Scene::at(picture, 12, 13), wood);
  EXPECT_TRUE(is_blue(Scene::at(picture, 2, 50)));
  EXPECT_EQ(Scene::at(picture, 8, 50), wood);
}

// As a scanner without colours makes it.
TEST(DrawStock, DrawsInColoursOverAGreyMap) {
  Scene scene;
  scene.map.pixels = cv::Mat(60, 100, CV_8UC1, cv::Scalar(130));
  scene.allocate(10, 10, db::AllocationState::kReserved);
  const cv::Mat picture = draw_stock(scene.map, scene.mask, scene.live);
  EXPECT_EQ(Scene::at(picture, 35, 45), cv::Vec3b(130, 130, 130));
  const cv::Vec3b reserved = Scene::at(picture, 15, 15), unusable = Scene::at(picture, 75, 30);
  EXPECT_GT(reserved[0], reserved[2] + 50) << "blue";
  EXPECT_GT(unusable[0], 180) << "pale";
  EXPECT_EQ(unusable[0], unusable[2]);
}

TEST(DrawStock, LeavesTheMapAsItIs) {
  Scene scene;
  scene.allocate(10, 10, db::AllocationState::kReserved);
  draw_stock(scene.map, scene.mask, scene.live);
  EXPECT_EQ(Scene::at(scene.map.pixels, 15, 15), cv::Vec3b(60, 90, 120));
}

TEST(FreeWood, GivesNoPixelThatAnAllocationOrItsMarginTouches) {
  Scene scene;
  scene.allocate(10, 10, db::AllocationState::kReserved);
  const Raster<PanelFrame> free = free_wood({scene.mask, {1.0}, {}}, {scene.live.front().area}, Millimetres(2));
  for (int x = 0; x < 50; ++x) {
    for (int y = 1; y <= 60; ++y) {
      const bool touched = x + 1 > 8 && x < 22 && y > 8 && y - 1 < 22;
      const int found = free.pixels.at<std::uint8_t>(60 - y, x);
      const bool far = x + 1 < 6 || x > 24 || y < 6 || y - 1 > 24;
      if (touched || far) {
        EXPECT_EQ(found, far ? 255 : 0) << x << ' ' << y;
      }
    }
  }
  EXPECT_DOUBLE_EQ(wood_area({scene.mask, {1.0}, {}}).count(), 50 * 60);
}

// Where nothing is to be grown, shapes are drawn as they are: a comb of 100,000 corners took more than two minutes
// else.
TEST(FreeWood, WithoutAMarginIsAsIfGrownByNothing) {
  Ring<PanelFrame> comb;
  for (int i = 0; i < 12; ++i)
    for (const auto& [x, y] : {std::pair{0.0, 10.0}, {0.0, 50.5}, {1.4, 50.5}, {1.4, 10.0}})
      comb.push_back(Scene::corner(5.3 + 3 * i + x, y));
  comb.push_back(Scene::corner(50, 5)), comb.push_back(Scene::corner(2, 5));
  const Raster<PanelFrame> mask{cv::Mat(60, 100, CV_8UC1, cv::Scalar(255)), {1.0}, {}};
  const Region<PanelFrame> area = subtract(
      Region<PanelFrame>(comb), Region<PanelFrame>(Ring<PanelFrame>{Scene::corner(10, 6), Scene::corner(20, 6),
                                                                    Scene::corner(20, 9), Scene::corner(10, 9)}));
  ASSERT_EQ(area.rings().size(), 2U) << "with a hole in it";
  const cv::Mat drawn = free_wood(mask, {area}, Millimetres(0)).pixels;
  EXPECT_LT(cv::countNonZero(drawn), 60 * 100 - 12 * 40);
  EXPECT_EQ(cv::countNonZero(drawn != free_wood(mask, {offset(area, Millimetres(0))}, Millimetres(0)).pixels), 0);
}

}  // namespace
}  // namespace veneer::daemon
