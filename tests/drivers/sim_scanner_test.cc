#include "drivers/sim/scanner.h"

#include <gmock/gmock.h>

#include "base/units.h"
#include "tests/drivers/sim_sheets.h"

namespace veneer::sim {
namespace {

// A device as bad as the twin's, but without noise and dust, and with a small glass.
ScannerTruth device(std::uint64_t seed) {
  TwinSettings settings;
  settings.seed = seed;
  settings.scanner.width_mm = 120, settings.scanner.height_mm = 100;
  ScannerTruth truth = draw_cell_truth(settings).scanner;
  truth.noise = 0, truth.dust = 0, truth.uneven_light = 0;
  return truth;
}

ScanTruth lying(SheetFace face, double angle_deg, Vec2 shift, double width, std::uint64_t seed = 3, double dpi = 300) {
  ScanTruth truth;
  truth.capture = "capture-1", truth.sheet = "dotted", truth.face = face;
  truth.px_per_mm = dpi / 25.4;
  truth.scanner = device(seed);
  truth.glass_from_sheet = {degrees(angle_deg).count(), face == SheetFace::kBack, shift};
  if (face == SheetFace::kBack) truth.glass_from_sheet.shift = shift + Vec2{width, 0};
  return truth;
}

const std::vector<Vec2> kDots = {{10, 12}, {60, 15}, {75, 50}, {20, 45}};

TEST(Scanner, ShowsMarksWhereItsTruthRecordSaysTheyAre) {
  for (const double dpi : {150.0, 300.0, 600.0}) {
    const ScanTruth truth = lying(SheetFace::kShow, 2.2, {12, 14}, 90, 3, dpi);
    const auto sheet = dotted_sheet(90, 65, kDots, {}, 20);
    const cv::Mat scan = render_scan(truth, sheet.get(), 1);
    EXPECT_EQ(scan.cols, static_cast<int>(std::lround(120 * dpi / 25.4)));
    for (const Vec2& dot : kDots) {
      const Vec2 expected = truth.scan_pixel(dot);
      const Vec2 found = dark_centre(scan, expected, static_cast<int>(2.5 * truth.px_per_mm), 215.0);
      EXPECT_NEAR(found.x, expected.x, 0.03) << dpi << " dpi";
      EXPECT_NEAR(found.y, expected.y, 0.03) << dpi << " dpi";
    }
  }
}

TEST(Scanner, ErrsByItsWarpAndScaleAndTheRecordInvertsExactly) {
  const ScanTruth truth = lying(SheetFace::kShow, 1.0, {12, 14}, 90);
  double worst = 0;
  for (const Vec2& dot : kDots) {
    const Vec2 back = truth.sheet_mm(truth.scan_pixel(dot));
    EXPECT_NEAR(back.x, dot.x, 1e-8);
    EXPECT_NEAR(back.y, dot.y, 1e-8);
    const Vec2 glass = truth.glass_from_sheet.place(dot);
    const Vec2 naive{glass.x * truth.px_per_mm, (100 - glass.y) * truth.px_per_mm};
    worst = std::max(worst, length(naive - truth.scan_pixel(dot)) / truth.px_per_mm);
  }
  EXPECT_GT(worst, 0.05);
  EXPECT_LT(worst, 0.7);
}

// A scan of the show face looks like the show face: what is at the upper left of the sheet is at the upper left.
TEST(Scanner, ShowsTheShowFaceAsSeenFromTheShowSide) {
  const auto sheet = dotted_sheet(90, 65, {{8, 57}}, {});
  const cv::Mat scan = render_scan(lying(SheetFace::kShow, 0, {10, 10}, 90), sheet.get(), 1);
  const Vec2 found = dark_centre(scan, {18 * 11.81, 33 * 11.81}, 40, 215);
  EXPECT_NEAR(found.x / 11.81, 18, 1.2);
  EXPECT_NEAR(found.y / 11.81, 33, 1.2);
}

// Turned over about its vertical axis: the dot at the sheet's left is at the right of the scan.
TEST(Scanner, ShowsTheBackFaceAsSeenFromTheBack) {
  const auto sheet = dotted_sheet(90, 65, {}, {{8, 57}});
  const cv::Mat scan = render_scan(lying(SheetFace::kBack, 0, {10, 10}, 90), sheet.get(), 1);
  const double x = (10 + 90 - 8) * 11.81, y = 33 * 11.81;
  const Vec2 found = dark_centre(scan, {x, y}, 40, 195);
  EXPECT_NEAR(found.x / 11.81, x / 11.81, 1.2);
  EXPECT_NEAR(found.y / 11.81, y / 11.81, 1.2);
}

TEST(Scanner, SeesTheLidThroughKerfAndHolesAndEngravingOnItsOwnFaceOnly) {
  const auto sheet = dotted_sheet(90, 65, {}, {}, 15.748);
  sheet->front = cv::Scalar(60, 90, 120);
  sheet->back = cv::Scalar(60, 90, 120);
  burn_stroke(*sheet, stroke(BurnDepth::kThrough, SheetFace::kBack, 0.30, square({20, 20}, 15)));
  burn_stroke(*sheet, stroke(BurnDepth::kThrough, SheetFace::kBack, 0.30, {{60, 20}, {60, 50}}));
  burn_stroke(*sheet, stroke(BurnDepth::kEngrave, SheetFace::kBack, 0.4, {{70, 20}, {70, 50}}));
  drop_loose_pieces(*sheet);
  for (const SheetFace face : {SheetFace::kShow, SheetFace::kBack}) {
    const ScanTruth truth = lying(face, 0.7, {12, 14}, 90);
    const cv::Mat scan = render_scan(truth, sheet.get(), 1);
    const auto green = [&](Vec2 mm) {
      const Vec2 p = truth.scan_pixel(mm);
      return static_cast<int>(scan.at<cv::Vec3b>(static_cast<int>(p.y), static_cast<int>(p.x))[1]);
    };
    EXPECT_NEAR(green({10, 10}), 90, 2);
    EXPECT_GT(green({27, 27}), 170);  // the hole of the fallen piece
    EXPECT_GT(green({60, 35}), 110);  // kerf: lid, blurred with its burnt edges
    const bool engraved = green({70, 35}) < 60, untouched = std::abs(green({70, 35}) - 90) <= 2;
    EXPECT_TRUE(face == SheetFace::kBack ? engraved : untouched);
  }
}

// A lens spreads the light of wood, rim and slit; it takes none away and adds none, however soft it is.
TEST(Scanner, SoftOpticsLeaveTheLightOfASlitAsItIs) {
  const auto sheet = dotted_sheet(90, 65, {}, {}, 23.622);
  sheet->front = cv::Scalar(120, 160, 190);
  burn_stroke(*sheet, stroke(BurnDepth::kThrough, SheetFace::kBack, 0.28, {{40, 10}, {40, 55}}));
  const auto light_of = [&](double psf_px) {
    ScanTruth truth = lying(SheetFace::kShow, 0, {12, 14}, 90);
    truth.scanner.psf_px = psf_px;
    const cv::Mat scan = render_scan(truth, sheet.get(), 1);
    const Vec2 middle = truth.scan_pixel({40, 32});
    return cv::mean(scan(cv::Rect(static_cast<int>(middle.x) - 14, static_cast<int>(middle.y) - 100, 28, 200)));
  };
  const cv::Scalar sharp = light_of(0.35), soft = light_of(1.4);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(soft[k], sharp[k], 0.4) << "channel " << k;
}

// The lid lies in the sheet's shade, which no lamp draws in steps.
TEST(Scanner, ShadesTheLidSmoothly) {
  const auto sheet = dotted_sheet(90, 65, {}, {}, 20);
  const ScanTruth truth = lying(SheetFace::kShow, 0, {12, 14}, 90);
  const cv::Mat scan = render_scan(truth, sheet.get(), 1);
  const Vec2 edge = truth.scan_pixel({0, 32});
  const auto green = [&](int beside) {
    return cv::mean(scan(cv::Rect(static_cast<int>(edge.x) - beside, static_cast<int>(edge.y) - 50, 1, 100)))[1];
  };
  for (int beside = 4; beside < 35; ++beside) EXPECT_LT(std::abs(green(beside + 1) - green(beside)), 3) << beside;
  EXPECT_GT(green(35) - green(4), 10);
}

TEST(Scanner, ShowsOnlyItsLidWhenNothingLiesOnIt) {
  const cv::Mat scan = render_scan(lying(SheetFace::kShow, 0, {0, 0}, 90), nullptr, 1);
  EXPECT_GT(cv::mean(scan)[1], 225);
}

TEST(Scanner, AddsTheSameNoiseAndDustToTheSameCapture) {
  ScanTruth truth = lying(SheetFace::kShow, 0, {10, 10}, 90);
  truth.scanner.noise = 2, truth.scanner.dust = 1;
  const auto sheet = dotted_sheet(90, 65, kDots, {});
  const cv::Mat one = render_scan(truth, sheet.get(), 5), same = render_scan(truth, sheet.get(), 5);
  const cv::Mat other = render_scan(truth, sheet.get(), 6);
  EXPECT_EQ(cv::norm(one, same, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(one, other, cv::NORM_INF), 5);
}

}  // namespace
}  // namespace veneer::sim
