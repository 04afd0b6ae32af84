// A picture that shows no tag is one of an empty bed only where it would show tags.
#include "calib/picture_sight.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "calib/tag_detector.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

cv::Mat without_noise(const std::vector<test::SceneSheet>& sheets) {
  test::TrueCamera camera;  // of 2.3 pixels a millimetre: quickly drawn
  camera.width = 1400, camera.height = 1050;
  camera.focal = 1092, camera.cx = 707.9, camera.cy = 519.9;
  return test::photograph(camera, sheets, {.noise = 0});
}

cv::Mat panel_on_the_bed() {
  constexpr double kTag = 14;
  return without_noise({{{120, 60, 5, false}, 2.0, [](double x, double y) {
                           if (x < 0 || y < 0 || x > 220 || y > 150) return test::kNothingHere;
                           for (const auto& [id, ox, oy] : {std::tuple(215, 8.0, 8.0), std::tuple(216, 190.0, 8.0),
                                                            std::tuple(217, 8.0, 125.0), std::tuple(218, 190.0, 125.0)})
                             if (const float tag = test::tag_shade(id, (x - ox) / kTag, (y - oy) / kTag);
                                 tag != test::kNothingHere)
                               return tag;
                           return 170.0F;
                         }}});
}

struct Light {
  double gain = 1, blur_px = 0, veil = 0, noise = 3;
};

cv::Mat in_light(const cv::Mat& scene, const Light& light) {
  cv::Mat seen, noise;
  scene.convertTo(seen, CV_32F, light.gain, light.veil);
  if (light.blur_px > 0) cv::GaussianBlur(seen, seen, {}, light.blur_px);
  noise.create(seen.size(), seen.type());
  cv::RNG random(7);
  random.fill(noise, cv::RNG::NORMAL, 0, light.noise);
  cv::Mat out;
  cv::Mat(seen + noise).convertTo(out, scene.type());
  return out;
}

// As it was set for the camera, or brighter. In dimmer light it may be told to show nothing, and is asked for again.
TEST(PictureSight, AnEmptyBedInWorkableLightIsSeen) {
  const cv::Mat bed = without_noise({});
  for (const double gain : {1.3, 1.0}) EXPECT_GT(share_in_sight(in_light(bed, {.gain = gain})), 0.5) << gain;
}

// The lamp goes out, the lens fogs, or something lies over it: never is that taken for a bed from which the panel is
// gone.
TEST(PictureSight, WhereAPanelsTagsAreLostNothingElseIsInSight) {
  const cv::Mat panel = panel_on_the_bed();
  std::vector<Light> lights;
  for (const double gain : {1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.0})
    for (const double noise : {1.0, 8.0, 15.0}) lights.push_back({.gain = gain, .noise = noise});
  for (const double blur : {2.0, 4.0, 8.0, 16.0}) lights.push_back({.blur_px = blur});
  for (const double gain : {0.3, 0.1, 0.03}) lights.push_back({.gain = gain, .veil = 150});
  lights.push_back({.gain = 3, .veil = 200});  // overexposed
  int lost = 0;
  for (const Light& light : lights) {
    const cv::Mat picture = in_light(panel, light);
    if (!detect_tags<CameraFrame>(picture).empty()) continue;
    ++lost;
    EXPECT_LT(share_in_sight(picture), kLeastInSight)
        << "gain " << light.gain << ", blur " << light.blur_px << ", veil " << light.veil << ", noise " << light.noise;
  }
  EXPECT_GT(lost, 8) << "the light is taken far enough";
}

TEST(PictureSight, ABrokenFrameOfOneShadeShowsNothing) {
  for (const int grey : {0, 16, 128, 255})
    EXPECT_EQ(share_in_sight(cv::Mat(300, 400, CV_8UC3, cv::Scalar::all(grey))), 0) << grey;
}

}  // namespace
}  // namespace veneer::calib
