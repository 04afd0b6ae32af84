// A bare board is found by its outline, where it lies, and neither an empty bed nor the picture's own rim is one.
#include "calib/board_finder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/exact_camera.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

test::TrueCamera quick_camera() {
  test::TrueCamera camera;  // of 2.3 pixels a millimetre: quickly drawn
  camera.width = 1400, camera.height = 1050;
  camera.focal = 1092, camera.cx = 707.9, camera.cy = 519.9;
  return camera;
}

test::SceneSheet board(double width, double height, float grey, const test::Lay& lay, double thickness = 3) {
  return {lay, thickness, [=](double x, double y) {
            return std::abs(x) <= width / 2 && std::abs(y) <= height / 2 ? grey : test::kNothingHere;
          }};
}

constexpr Millimetres kThick{3};

std::vector<FoundBoard> found(const std::vector<test::SceneSheet>& sheets, double width, double height) {
  const test::TrueCamera camera = quick_camera();
  return find_boards(test::photograph(camera, sheets), exact_model(camera),
                     {Millimetres(width), Millimetres(height), kThick});
}

constexpr test::Lay kMiddle{240, 140, 0, false};

TEST(BoardFinder, ABoardIsFoundWhereItLiesHoweverDarkAndAslantItIs) {
  for (const float grey : {70.0F, 250.0F})
    for (const double turn : {-4.0, 12.0}) {
      const auto boards = found({board(300, 200, grey, {250, 128, turn, false})}, 300, 200);
      ASSERT_EQ(boards.size(), 1U) << grey << " at " << turn;
      EXPECT_NEAR(boards[0].centre.x.count(), 250, 1.5);
      EXPECT_NEAR(boards[0].centre.y.count(), 128, 1.5);
      EXPECT_NEAR(boards[0].turn_deg, turn, 0.5);
      EXPECT_TRUE(lies_as_wanted(boards[0], {Millimetres(300), Millimetres(200), kThick}));
    }
  EXPECT_EQ(found({board(303, 198, 150, kMiddle)}, 300, 200).size(), 1U) << "measured with a ruler";
}

// Burnt along the bed's axes, a pattern reaches past the edges of a board that lies the other way.
TEST(BoardFinder, ABoardThatLiesTheOtherWayIsToldAsThat) {
  const WantedBoard wanted{Millimetres(300), Millimetres(200), kThick};
  const auto boards = found({board(200, 300, 150, kMiddle)}, 300, 200);
  ASSERT_EQ(boards.size(), 1U);
  EXPECT_FALSE(lies_as_wanted(boards[0], wanted));
  EXPECT_NEAR(boards[0].width.count(), 200, 2);
  EXPECT_NEAR(boards[0].height.count(), 300, 2);
}

TEST(BoardFinder, AnEmptyBedAndABoardOfAnotherSizeAreNone) {
  EXPECT_TRUE(found({}, 300, 200).empty());
  EXPECT_TRUE(found({board(250, 200, 150, kMiddle)}, 300, 200).empty());
  EXPECT_TRUE(found({board(300, 180, 150, kMiddle)}, 300, 200).empty());
  EXPECT_TRUE(found({board(340, 230, 150, kMiddle)}, 300, 200).empty());
  // Round, as large.
  EXPECT_TRUE(
      found({{kMiddle, 3,
              [](double x, double y) { return std::hypot(x / 150, y / 100) <= 1 ? 150.0F : test::kNothingHere; }}},
            300, 200)
          .empty());
  // Half of it beyond what the camera sees.
  EXPECT_TRUE(found({board(300, 200, 150, {520, 140, 0, false})}, 300, 200).empty());
}

// A camera in a lid may see about as much of the bed as the board is large.
TEST(BoardFinder, AllThatIsInSightIsNoBoard) {
  test::TrueCamera camera = quick_camera();
  camera.tilt_deg = camera.lean_deg = camera.yaw_deg = 0, camera.lens = {};
  const auto corner = camera.bed_of(0, 0, 3), other = camera.bed_of(camera.width, camera.height, 3);
  const double width = std::abs(other[0] - corner[0]), height = std::abs(other[1] - corner[1]);
  const cv::Mat empty = test::photograph(camera, {});
  const cv::Mat even(camera.height, camera.width, CV_8UC3, cv::Scalar::all(140));
  const cv::Mat dark(camera.height, camera.width, CV_8UC3, cv::Scalar::all(0));
  const test::Lay under{(corner[0] + other[0]) / 2, (corner[1] + other[1]) / 2, 0, false};
  const cv::Mat larger = test::photograph(camera, {board(width + 50, height + 50, 200, under)});
  for (const double less : {4.0, 9.0})
    for (const cv::Mat* picture : {&empty, &even, &dark, &larger})
      EXPECT_TRUE(
          find_boards(*picture, exact_model(camera), {Millimetres(width - less), Millimetres(height - less), kThick})
              .empty())
          << less;
  // One that does end in the picture is found.
  const cv::Mat whole = test::photograph(camera, {board(width - 16, height - 16, 200, under)});
  EXPECT_EQ(find_boards(whole, exact_model(camera), {Millimetres(width - 16), Millimetres(height - 16), kThick}).size(),
            1U);
}

}  // namespace
}  // namespace veneer::calib
