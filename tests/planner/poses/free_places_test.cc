// What is worked out once for all poses of a patch answers as the wood itself does.
#include "planner/poses/free_places.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

RC_GTEST_PROP(FreePlaces, AnswerAsTheWoodDoes, ()) {
  const auto number = [](int low, int high) { return *rc::gen::inRange(low * 1000, high * 1000) / 1000.0; };
  Ring<ArtworkFrame> outline;  // with notches, nearly always
  for (int k = 0; k < 9; ++k) {
    const double radius = number(2, 6), angle = 2 * CV_PI * k / 9;
    outline.push_back(point<ArtworkFrame>(10 + radius * std::cos(angle), 10 + radius * std::sin(angle)));
  }
  Raster<PanelFrame> free;
  free.pixels = cv::Mat(120, 120, CV_8UC1, cv::Scalar(255));
  free.resolution = ScanResolution{4};
  for (int k = 0; k < 4; ++k)
    cv::circle(free.pixels, {*rc::gen::inRange(0, 120), *rc::gen::inRange(0, 120)}, 5, cv::Scalar(0), cv::FILLED);
  const Millimetres kerf(number(0, 1) / 2);
  std::vector<MatchPanel> panels{{free, FreeWood(free, kerf, Millimetres(0.1))}};
  const Footprint footprint(outline, kerf + FreeWood::kSlack);
  if (*rc::gen::arbitrary<bool>()) {
    panels[0].wood.allocate(footprint.panel_from_artwork(pose_at(0, 15, 15, 1)) * outline);
    panels[0].wood.settle();
  }
  const FreePlaces places(outline, footprint, panels);
  for (int k = 0; k < 40; ++k) {
    const Pose at = pose_at(0, number(0, 30), number(0, 30), number(0, 7));
    RC_ASSERT(places.on_free_wood(at) == panels[0].wood.on_free_wood(footprint.panel_from_artwork(at) * outline));
  }
}

constexpr double kTip = 4;  // mm from the star's middle

// Six tips of 60 degrees, each cut off to this width.
Ring<ArtworkFrame> star(double cap) {
  Ring<ArtworkFrame> out;
  const auto add = [&](double angle, double along, double across) {
    const double x = std::cos(angle), y = std::sin(angle);
    out.push_back(point<ArtworkFrame>(10 + along * x - across * y, 10 + along * y + across * x));
  };
  for (int k = 0; k < 6; ++k) {
    const double angle = k * CV_PI / 3;
    if (cap > 0) add(angle, kTip, -cap / 2);
    add(angle, kTip, cap / 2);
    add(angle + CV_PI / 6, kTip / std::sqrt(3), 0);
  }
  return out;
}

// At 60 degrees a corner's growth turns from pointed to blunt: there rounding decides which it is, anew at each angle.
class FreePlacesOfAStar : public ::testing::TestWithParam<double> {};

TEST_P(FreePlacesOfAStar, AnswerAsTheWoodDoes) {
  constexpr int kPlaces = 360;
  constexpr double kMiddle = 8;  // mm
  const Ring<ArtworkFrame> outline = star(GetParam());
  const Millimetres kerf(0.5), margin(0.1);
  const Footprint footprint(outline, kerf + FreeWood::kSlack);
  int refused = 0, wrong = 0;
  for (int k = 0; k < kPlaces; ++k) {
    const Pose at = pose_at(0, kMiddle, kMiddle, 0.1 + 0.17 * k);
    // A pointed tip reaches out twice as far as a blunt one. Wood is gone between the two.
    const double far = kTip + 1.5 * (kerf + margin).count(), towards = at.angle + k % 6 * CV_PI / 3;
    Raster<PanelFrame> free;
    free.pixels = cv::Mat(320, 320, CV_8UC1, cv::Scalar(255));
    free.resolution = ScanResolution{20};
    double column = 0, row = 0;
    free.to_pixels(point<PanelFrame>(kMiddle + far * std::cos(towards), kMiddle + far * std::sin(towards)), column,
                   row);
    free.pixels.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column)) = 0;
    const std::vector<MatchPanel> panels{{free, FreeWood(free, kerf, margin)}};
    const bool admitted = panels[0].wood.on_free_wood(footprint.panel_from_artwork(at) * outline);
    if (!admitted) ++refused;
    if (FreePlaces(outline, footprint, panels).on_free_wood(at) != admitted) ++wrong;
  }
  EXPECT_GT(refused, 0) << "some are pointed";
  EXPECT_LT(refused, kPlaces) << "and some are blunt";
  EXPECT_EQ(wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Pointed, FreePlacesOfAStar, ::testing::Values(0.0));
INSTANTIATE_TEST_SUITE_P(CutOffWithinRounding, FreePlacesOfAStar, ::testing::Values(0.0008));

}  // namespace
}  // namespace veneer::planner
