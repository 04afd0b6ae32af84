#include "calib/hole_detector.h"

#include <gmock/gmock.h>

#include <opencv2/imgproc.hpp>

#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::detect_holes;
using calib::Hole;

struct Sheet {
  rendered::Panel panel = rendered::sample_panel();
  rendered::Scanner scanner;
  Isometry2<GlassFrame, PanelFrame> glass_from_panel;
  Face face;

  explicit Sheet(Face of, double angle_deg = 3) : face(of) {
    scanner.width_mm = 170, scanner.height_mm = 130;
    glass_from_panel = rendered::lay(75, 55, 85, 65, angle_deg, face);
  }
  cv::Mat scan() const { return scan_panel(panel, face, glass_from_panel, scanner); }
  // The farthest of the true holes from its nearest find, mm.
  double worst(const std::vector<Hole>& holes) const {
    double worst = 0;
    for (const auto& hole : panel.holes) {
      const Point<ScanFrame> truth = scanner.scan_from_glass(glass_from_panel * point<PanelFrame>(hole.x, hole.y));
      double nearest = 1e9;
      for (const Hole& found : holes) nearest = std::min(nearest, distance(found.centre, truth).count());
      worst = std::max(worst, nearest / scanner.nominal().px_per_mm);
    }
    return worst;
  }
};

TEST(HoleDetector, FindsThroughHolesOnBothFacesAndNothingElse) {
  for (const Face face : {Face::kShow, Face::kBack}) {
    const Sheet sheet(face);
    const auto holes = detect_holes(sheet.scan(), sheet.scanner.nominal());
    ASSERT_EQ(holes.size(), 4U) << to_string(face);
    EXPECT_LT(sheet.worst(holes), 0.010) << to_string(face);
    for (const Hole& hole : holes) EXPECT_NEAR(hole.diameter.count() / sheet.scanner.nominal().px_per_mm, 6, 0.7);
  }
}

TEST(HoleDetector, StandsNoiseDustUnevenLightAndAPoorLens) {
  for (const Face face : {Face::kShow, Face::kBack}) {
    Sheet sheet(face, 100);
    sheet.glass_from_panel = rendered::lay(75, 55, 65, 85, 100, face);
    sheet.scanner.width_mm = 130, sheet.scanner.height_mm = 170;
    sheet.scanner.optics.noise = 5, sheet.scanner.optics.psf_px = 1.2, sheet.scanner.optics.uneven_light = 0.12;
    cv::Mat picture = sheet.scan();
    cv::RNG rng(3);
    for (int i = 0; i < 200; ++i)
      cv::circle(picture, {rng.uniform(0, picture.cols), rng.uniform(0, picture.rows)}, 2, cv::Scalar(70, 75, 80), -1);
    const auto holes = detect_holes(picture, sheet.scanner.nominal());
    ASSERT_EQ(holes.size(), 4U) << to_string(face);
    EXPECT_LT(sheet.worst(holes), 0.020) << to_string(face);
  }
}

TEST(HoleDetector, DoesNotTakeACutOutPieceForAHole) {
  Sheet sheet(Face::kShow);
  sheet.panel.gone = {{{50, 40}, {56, 40}, {56, 46}, {50, 46}}, {{70, 40}, {84, 41}, {80, 55}}};
  EXPECT_EQ(detect_holes(sheet.scan(), sheet.scanner.nominal()).size(), 4U);
}

TEST(HoleDetector, FindsHolesOfAnotherDiameterOnlyWhenAsked) {
  Sheet sheet(Face::kBack);
  for (auto& hole : sheet.panel.holes) hole.diameter = 5;
  const cv::Mat picture = sheet.scan();
  EXPECT_TRUE(detect_holes(picture, sheet.scanner.nominal()).empty());
  EXPECT_EQ(detect_holes(picture, sheet.scanner.nominal(), {.diameter = Millimetres(5)}).size(), 4U);
}

TEST(HoleDetector, FindsNothingOnAnEmptyGlass) {
  EXPECT_TRUE(
      detect_holes(cv::Mat(600, 600, CV_8UC3, cv::Scalar(244, 244, 244)), ScanResolution::from_dpi(300)).empty());
  EXPECT_TRUE(detect_holes(cv::Mat(), ScanResolution::from_dpi(300)).empty());
}

}  // namespace
}  // namespace veneer
