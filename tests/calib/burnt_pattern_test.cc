// The pattern as it is burnt, its rings at uneven distances down to 14 mm, found on a picture of the board.
#include "calib/burnt_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "calib/machine_axes.h"
#include "planner/cutting/calibration_pattern.h"
#include "tests/support/exact_camera.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

// Rings and kerf lines in a pale board, in the renderer's bed millimetres, which are the machine's here.
class BurntBoard {
 public:
  explicit BurntBoard(const CalibrationPattern& pattern) : pattern_(pattern) {
    for (int c = 0; c < pattern.columns; ++c) across_.push_back(ring(c, 0).centre.x.count());
    for (int r = 0; r < pattern.rows; ++r) up_.push_back(ring(0, r).centre.y.count());
  }
  float shade(double x, double y) const {
    if (x < 15 || y < 45 || x > 505 || y > 335) return test::kNothingHere;
    const PatternRing& near = ring(nearest(across_, x), nearest(up_, y));
    const double off = std::hypot(x - near.centre.x.count(), y - near.centre.y.count()) - near.diameter.count() / 2;
    if (std::abs(off) < 0.1) return 70.0F;
    for (const KerfLine& line : pattern_.kerf_lines)
      if (x > line.from.x.count() - 0.14 && x < line.to.x.count() + 0.14 && y > line.from.y.count() - 0.14 &&
          y < line.to.y.count() + 0.14)
        return 30.0F;
    return static_cast<float>(190 + 7 * std::sin(y * 2.1 + std::sin(x * 0.03) * 3));
  }

 private:
  const PatternRing& ring(int column, int row) const {
    return pattern_.rings[static_cast<std::size_t>(row * pattern_.columns + column)];
  }
  static int nearest(const std::vector<double>& places, double at) {
    const auto best = std::ranges::min_element(places, {}, [&](double place) { return std::abs(place - at); });
    return static_cast<int>(best - places.begin());
  }

  const CalibrationPattern& pattern_;
  std::vector<double> across_, up_;
};

TEST(BurntPattern, OfUnevenRingsIsFoundButForTwoAtMost) {
  PatternLayout layout;
  layout.area.add(point<MachineFrame>(50, 87)), layout.area.add(point<MachineFrame>(470, 293));
  const auto pattern = planner::make_pattern(layout);
  ASSERT_TRUE(pattern.ok());
  const BurntBoard board(*pattern);
  test::TrueCamera camera;
  camera.eye_z = 560, camera.tilt_deg = 6, camera.eye_y = 150;
  const cv::Mat picture = test::photograph(camera, {{{}, 2.1, [&](double x, double y) { return board.shade(x, y); }}},
                                           {.noise = 3, .samples = 3, .thin_lines = true, .seed = 21});
  const CameraModel model = exact_model(camera).re_anchored({degrees(-3.1), point<BedFrame>(24, 33)});
  const auto rings = find_burnt_pattern(picture, model, 2.1_mm, pattern->rings);
  ASSERT_TRUE(rings.ok()) << rings.error().message;
  EXPECT_GE(rings->size(), pattern->rings.size() - 2);
  const auto axes = fit_machine_axes(*rings, model, 2.1_mm);
  ASSERT_TRUE(axes.ok()) << axes.error().message;
  EXPECT_EQ(axes->dropped, 0);
  EXPECT_LT(axes->rms.count(), 0.03);  // 0.025 on this picture with either spacing
  EXPECT_NEAR(axes->scale_x, 1, 5e-5);
  EXPECT_NEAR(axes->scale_y, 1, 5e-5);
}

// As many rings as the camera may see, among grain and noise.
TEST(BurntPattern, OfTheLargestBoardIsFound) {
  PatternLayout layout;
  layout.area.add(point<MachineFrame>(-100, -105)), layout.area.add(point<MachineFrame>(620, 475));
  const auto pattern = planner::make_pattern(layout);
  ASSERT_TRUE(pattern.ok());
  ASSERT_GT(pattern->rings.size(), 600U);
  test::TrueCamera camera;
  camera.width = 4000, camera.height = 3000, camera.focal = 3100, camera.cx = 2010, camera.cy = 1490;
  camera.eye_x = 260, camera.eye_y = 185, camera.eye_z = 780, camera.tilt_deg = 2, camera.lean_deg = -1;
  cv::Mat picture(camera.height, camera.width, CV_8UC1);
  for (int r = 0; r < picture.rows; ++r)
    for (int c = 0; c < picture.cols; ++c)
      picture.at<std::uint8_t>(r, c) = static_cast<std::uint8_t>(190 + 9 * std::sin(r * 0.9 + 3 * std::sin(c * 0.007)));
  constexpr int kShift = 6, kSides = 72;
  for (const PatternRing& ring : pattern->rings) {
    std::vector<cv::Point> rim;
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * kPi * i / kSides, radius = ring.diameter.count() / 2;
      const auto px = camera.pixel_of(ring.centre.x.count() + radius * std::cos(angle),
                                      ring.centre.y.count() + radius * std::sin(angle), 2.1);
      rim.emplace_back(static_cast<int>(std::lround((px[0] - 0.5) * (1 << kShift))),
                       static_cast<int>(std::lround((px[1] - 0.5) * (1 << kShift))));
    }
    cv::polylines(picture, rim, true, 70, 1, cv::LINE_AA, kShift);
  }
  cv::Mat noise(picture.size(), CV_16SC1);
  cv::theRNG().state = 21;
  cv::randn(noise, 0, 3);
  cv::add(picture, noise, picture, cv::noArray(), CV_8U);
  const auto rings = find_burnt_pattern(picture, exact_model(camera), 2.1_mm, pattern->rings);
  ASSERT_TRUE(rings.ok()) << rings.error().message;
  EXPECT_GE(rings->size(), pattern->rings.size() * 99 / 100);
  EXPECT_LT(distance(rings->front().centre, point<BedFrame>(-94, -99)).count(), 0.05);
}

}  // namespace
}  // namespace veneer::calib
