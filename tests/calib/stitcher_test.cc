#include "calib/stitcher.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::ScanMap;
using calib::StitchTile;

struct Bench {
  rendered::Panel panel = rendered::sample_panel(121.92, 91.44, 2);  // 720 x 540 px at 150 dpi
  rendered::Scanner scanner;

  Bench() {
    scanner.width_mm = 140, scanner.height_mm = 110, scanner.dpi = 150;
    scanner.optics.noise = 0;
  }
  // A tile whose map is the true one.
  StitchTile tile(double x, double gx, double angle_deg) const {
    const auto pose = rendered::lay(x, 45.72, gx, 55, angle_deg, Face::kShow);
    return {scan_panel(panel, Face::kShow, pose, scanner), ScanMap(pose.inverse(), {}, scanner.nominal())};
  }
  Box<PanelFrame> sheet() const { return {point<PanelFrame>(0, 0), point<PanelFrame>(panel.width, panel.height)}; }
  // What a perfect scanner sees of the upright panel at its map's resolution.
  cv::Mat truth(double dpi) const {
    rendered::Scanner straight;
    straight.width_mm = panel.width, straight.height_mm = panel.height, straight.dpi = dpi;
    straight.optics.noise = 0;
    return scan_panel(panel, Face::kShow, rendered::lay(0, panel.height, 0, 0, 0, Face::kShow), straight);
  }
};

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  const cv::Rect both(4, 4, std::min(a.cols, b.cols) - 8, std::min(a.rows, b.rows) - 8);
  cv::Mat difference;
  cv::absdiff(a(both), b(both), difference);
  const cv::Scalar mean = cv::mean(difference);
  return (mean[0] + mean[1] + mean[2]) / 3;
}

// Shift between two pictures in pixels, from their gradients.
cv::Point2d shift_between(const cv::Mat& a, const cv::Mat& b) {
  const cv::Rect both(4, 4, std::min(a.cols, b.cols) - 8, std::min(a.rows, b.rows) - 8);
  cv::Mat ga, gb;
  cv::cvtColor(a(both), ga, cv::COLOR_BGR2GRAY);
  cv::cvtColor(b(both), gb, cv::COLOR_BGR2GRAY);
  ga.convertTo(ga, CV_64F), gb.convertTo(gb, CV_64F);
  cv::Mat dx, dy, dt = gb - ga;
  cv::Sobel(ga, dx, CV_64F, 1, 0, 3, 1.0 / 8), cv::Sobel(ga, dy, CV_64F, 0, 1, 3, 1.0 / 8);
  const double xx = dx.dot(dx), xy = dx.dot(dy), yy = dy.dot(dy), xt = -dx.dot(dt), yt = -dy.dot(dt);
  const double det = xx * yy - xy * xy;
  return {(yy * xt - xy * yt) / det, (xx * yt - xy * xt) / det};
}

TEST(Stitcher, LaysPixelsWhereTheyBelongToAHundredthOfAPixel) {
  const Bench bench;
  for (const double angle : {2.0, 178.0}) {  // half a pixel too much would show with both signs
    const StitchTile tiles[] = {bench.tile(60, 70, angle)};
    calib::StitchOptions options;
    options.resolution = ScanResolution::from_dpi(150);
    const auto map = stitch(tiles, bench.sheet(), options);
    ASSERT_TRUE(map.ok()) << map.error().message;
    const cv::Mat truth = bench.truth(150);
    ASSERT_EQ(map->pixels.size(), truth.size());
    const cv::Mat& aligned = map->pixels;
    const cv::Point2d shift = shift_between(truth, aligned);
    EXPECT_NEAR(shift.x, 0, 0.01) << angle;
    EXPECT_NEAR(shift.y, 0, 0.01) << angle;
    EXPECT_LT(mean_difference(truth, aligned), 3) << angle;
  }
}

TEST(Stitcher, BlendsTilesWithoutASeam) {
  Bench bench;
  bench.panel = rendered::sample_panel(180, 91.44, 2);
  StitchTile left = bench.tile(0, 5, 0.5), right = bench.tile(180, 135, -0.8);
  right.pixels.convertTo(right.pixels, -1, 0.93);  // a lamp that has cooled
  const StitchTile tiles[] = {left, right};
  calib::StitchOptions options;
  options.resolution = ScanResolution::from_dpi(150);
  const auto map = stitch(tiles, bench.sheet(), options);
  ASSERT_TRUE(map.ok()) << map.error().message;
  cv::Mat truth = bench.truth(150),
          aligned = map->pixels(cv::Rect(0, map->pixels.rows - truth.rows, truth.cols, truth.rows));
  // Gains leave the common level open; apart from it the map is the truth.
  aligned.convertTo(aligned, -1, cv::mean(truth)[1] / cv::mean(aligned)[1]);
  EXPECT_LT(mean_difference(truth, aligned), 3.5);
  options.compensate_exposure = false;
  const auto raw = stitch(tiles, bench.sheet(), options);
  ASSERT_TRUE(raw.ok());
  aligned = raw->pixels(cv::Rect(0, raw->pixels.rows - truth.rows, truth.cols, truth.rows));
  const double left_level = cv::mean(aligned.colRange(0, 200))[1] / cv::mean(truth.colRange(0, 200))[1];
  const double right_level = cv::mean(aligned.colRange(truth.cols - 200, truth.cols))[1] /
                             cv::mean(truth.colRange(truth.cols - 200, truth.cols))[1];
  EXPECT_GT(left_level / right_level, 1.04);
}

TEST(Stitcher, IsWhiteWhereNoTileSees) {
  const Bench bench;
  const StitchTile tiles[] = {bench.tile(60, 70, 0)};
  calib::StitchOptions options;
  options.resolution = ScanResolution::from_dpi(75);
  const auto map = stitch(tiles, {point<PanelFrame>(-30, 0), point<PanelFrame>(60, 50)}, options);
  ASSERT_TRUE(map.ok());
  EXPECT_EQ(map->pixels.at<cv::Vec3b>(40, 5), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(map->origin, point<PanelFrame>(-30, 0));
  EXPECT_NE(map->pixels.at<cv::Vec3b>(40, map->pixels.cols - 5), cv::Vec3b(255, 255, 255));
}

TEST(Stitcher, RefusesNothingAndOtherPictures) {
  const Bench bench;
  EXPECT_FALSE(calib::stitch({}, bench.sheet()).ok());
  StitchTile grey[] = {bench.tile(60, 70, 0)};
  EXPECT_FALSE(calib::stitch(grey, Box<PanelFrame>()).ok());
  grey[0].pixels = cv::Mat(10, 10, CV_8UC1);
  EXPECT_FALSE(calib::stitch(grey, bench.sheet()).ok());
}

}  // namespace
}  // namespace veneer
