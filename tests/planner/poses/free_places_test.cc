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

}  // namespace
}  // namespace veneer::planner
