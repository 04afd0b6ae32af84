// A certificate says how far off it will be where nothing was measured. Held against what the twin draws, without
// pictures: corners of sheets are where its scanner truly shows them, rings where its laser truly burns them.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <optional>
#include <utility>
#include <vector>

#include "calib/error_lattice.h"
#include "calib/machine_axes.h"
#include "calib/point_fit.h"
#include "calib/scanner_error.h"
#include "calib/scanner_model.h"
#include "drivers/sim/cell_truth.h"
#include "drivers/sim/random.h"
#include "tests/support/played_sight.h"

namespace veneer::tests {
namespace {

using sim::Vec2;

constexpr double kDpi = 300, kGlassWidth = 190, kGlassHeight = 140;
constexpr double kCornerNoise = 0.05;  // px

// A sheet of 4 x 5 tags, 90 x 114 mm.
calib::AprilGrid small_grid() {
  calib::AprilGrid grid;
  grid.columns = 4, grid.rows = 5;
  return grid;
}

struct PlayedScanner {
  sim::CellTruth truth;
  sim::Random noise;

  PlayedScanner(std::uint64_t seed, double scan_warp_mm) : noise(seed, "played noise") {
    sim::TwinSettings settings;
    settings.seed = seed;
    settings.scanner.width_mm = kGlassWidth, settings.scanner.height_mm = kGlassHeight;
    settings.rough.scan_warp_mm = scan_warp_mm;
    truth = sim::draw_cell_truth(settings);
  }

  // The sheet with its lower left tag at (x, y) of the glass, y up.
  calib::GridScan scan(std::uint64_t number, double x, double y, double turn_deg, const calib::AprilGrid& grid) {
    const auto today = sim::scanner_of_today(truth, number);
    const sim::SheetPose pose{turn_deg * kPi / 180, false, {x, y}};
    calib::GridScan out{{}, ScanResolution::from_dpi(kDpi), 0, 0};
    const double px = out.nominal.px_per_mm;
    out.width_px = static_cast<int>(kGlassWidth * px), out.height_px = static_cast<int>(kGlassHeight * px);
    for (int id = grid.first_id; id < grid.first_id + grid.tags(); ++id) {
      calib::Tag<ScanFrame> tag;
      tag.id = id;
      const auto corners = grid.corners(id);
      for (std::size_t i = 0; i < 4; ++i) {
        const Vec2 seen = today.nominal_from_glass(pose.place({corners[i].x.count(), corners[i].y.count()}));
        const double off_x = kCornerNoise * noise.normal(), off_y = kCornerNoise * noise.normal();
        tag.corners[i] = point<ScanFrame>(seen.x * px + off_x, (kGlassHeight - seen.y) * px + off_y);
      }
      out.tags.push_back(tag);
    }
    return out;
  }
};

void tell(const char* where, const PredictedFigures& figures) {
  std::cout << where << ": " << figures.places << " places, predicted " << figures.predicted_mm()
            << " mm in the mean, truly " << figures.true_mm() << " mm rms; within two sigma " << 100 * figures.share()
            << " %, within twice the residual " << 100 * figures.share_by_residual() << " %\n";
}

// What is predicted holds, and not by claiming anything: it is no more than a few times what is true.
void expect_true(const PredictedFigures& figures, double most) {
  ASSERT_GT(figures.places, 300);
  EXPECT_GE(figures.share(), 0.9);
  EXPECT_LT(figures.predicted_mm(), most * figures.true_mm());
}

// Corners of sheets that are laid anew anywhere on the glass, in scans to come: where the map has them, against where
// they lie, the map laid as well as can be where it was measured.
void scan_anew(PlayedScanner& played, const calib::ScannerCertificateData& made, std::uint64_t first,
               PredictedFigures& inside, PredictedFigures& outside) {
  const calib::ScannerModel model(made.model);
  const auto nominal = ScanResolution::from_dpi(kDpi);
  const auto grid = small_grid();
  for (std::uint64_t number = first; number < first + 6; ++number) {
    const auto today = sim::scanner_of_today(played.truth, number);
    const auto said = [&](Vec2 at) {
      const Vec2 seen = today.nominal_from_glass(at);
      return model.glass_from_scan(
          point<ScanFrame>(seen.x * nominal.px_per_mm, (kGlassHeight - seen.y) * nominal.px_per_mm), nominal);
    };
    std::vector<Point<GlassFrame>> is, seems;
    for (double y = 5; y < kGlassHeight; y += 6)
      for (double x = 5; x < kGlassWidth; x += 6) {
        const auto there = calib::predicted_error(*made.predicted, x, kGlassHeight - y);
        if (!there || there->to_measured.count() > made.predicted->near_mm) continue;
        is.push_back(point<GlassFrame>(x, y - kGlassHeight)), seems.push_back(said({x, y}));
      }
    const std::span<const Point<GlassFrame>> to(is), from(seems);
    const auto laid = calib::fit_isometry(to, from);
    sim::Random hand(played.truth.settings.seed, "laid anew", number);
    const double turn = hand.spread(0.05) + (number % 2 == 0 ? 0 : kPi / 2);
    const double y0 = hand.uniform(5, 45);
    // Upright sheets anywhere; one that lies across reaches from its shift to the left.
    const double x0 = number % 2 == 0 ? hand.uniform(10, 95) : hand.uniform(122, 180);
    const sim::SheetPose pose{turn, false, {x0, y0}};
    for (int id = grid.first_id; id < grid.first_id + grid.tags(); ++id)
      for (const auto& corner : grid.corners(id)) {
        const Vec2 at = pose.place({corner.x.count(), corner.y.count()});
        const auto predicted = calib::predicted_error(*made.predicted, at.x, kGlassHeight - at.y);
        if (!predicted) continue;
        const double miss = distance(laid * said(at), point<GlassFrame>(at.x, at.y - kGlassHeight)).count();
        const bool is_inside = predicted->to_measured.count() <= made.predicted->near_mm;
        (is_inside ? inside : outside).add(miss, predicted->sigma.count(), made.rms.count());
      }
  }
}

// Two views, both at the left: 70 mm of the glass are left.
Result<calib::ScannerCertificateData> calibrate(PlayedScanner& played, const calib::AprilGrid& grid = small_grid()) {
  const std::vector<calib::GridScan> scans = {played.scan(1, 14, 10, 0.8, grid), played.scan(2, 9, 17, -1.1, grid)};
  calib::ScannerFitOptions options;
  options.min_tags = 20;
  return calib::fit_scanner_model(scans, grid, options);
}

void hold_against_truth(double scan_warp_mm, int seeds) {
  PredictedFigures inside, outside;
  for (int seed = 1; seed <= seeds; ++seed) {
    PlayedScanner played(static_cast<std::uint64_t>(seed), scan_warp_mm);
    const auto made = calibrate(played);
    ASSERT_TRUE(made.ok()) << "seed " << seed << ": " << made.error().message;
    ASSERT_TRUE(made->predicted);
    scan_anew(played, *made, 100, inside, outside);
  }
  tell("measured", inside), tell("beyond", outside);
  expect_true(inside, 3), expect_true(outside, 3);
  // What the certificate said before says nothing of places where nothing was measured.
  EXPECT_LT(outside.share_by_residual(), 0.7);
}

TEST(PredictedError, LiesBetweenThoseOfThePlacesAroundAndEndsWithTheGlass) {
  calib::ErrorLattice lattice = calib::lattice_over(10, 20, 50, 50, 20);
  ASSERT_EQ(lattice.columns, 3);
  ASSERT_EQ(lattice.rows, 3);
  lattice.near_mm = 16;
  calib::for_each_place(lattice, [&](std::size_t index, double x, double y) {
    lattice.sigma_mm[index] = x + 2 * y, lattice.measured_mm[index] = x;
  });
  for (const auto& [x, y] : {std::pair{10.0, 20.0}, {50, 50}, {50, 20}, {23, 41}}) {
    const auto there = calib::predicted_error(lattice, x, y);
    ASSERT_TRUE(there);
    EXPECT_NEAR(there->sigma.count(), x + 2 * y, 1e-9);
    EXPECT_NEAR(there->to_measured.count(), x, 1e-9);
  }
  for (const auto& [x, y] : {std::pair{9.0, 30.0}, {51, 30}, {30, 19}, {30, 51}, {std::nan(""), 30}})
    EXPECT_FALSE(calib::predicted_error(lattice, x, y)) << x << ", " << y;
  EXPECT_FALSE(calib::predicted_error({}, 0, 0));
  const auto outlook = calib::outlook_of(lattice);
  EXPECT_NEAR(outlook.measured_share, 0.15, 0.011);
  EXPECT_NEAR(outlook.worst.count(), 150, 1e-9);
}

TEST(PredictedError, OfAScannerHoldsWhereTheSheetLayAndWhereItDidNot) { hold_against_truth(0, 3); }

TEST(PredictedError, OfAScannerHoldsWhereItsCarriageRunsOtherwiseEachTime) { hold_against_truth(0.03, 3); }

// What differs from scan to scan is no noise: four times as many corners in the same two scans know it no better.
TEST(PredictedError, MoreCornersInTheSameScansDoNotAverageAwayWhatDiffersBetweenThem) {
  calib::AprilGrid fine = small_grid();
  fine.columns = 8, fine.rows = 10, fine.tag_size = Millimetres(9), fine.pitch = Millimetres(12);
  PredictedFigures coarsely, finely, ignored;
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const bool is_fine : {false, true}) {
      PlayedScanner played(seed, 0.03);
      const auto made = calibrate(played, is_fine ? fine : small_grid());
      ASSERT_TRUE(made.ok() && made->predicted);
      scan_anew(played, *made, 100, is_fine ? finely : coarsely, ignored);
    }
  }
  tell("a quarter of the corners", coarsely), tell("all of them", finely);
  EXPECT_GE(finely.share(), 0.9);
  EXPECT_GT(finely.predicted_mm(), 0.6 * coarsely.predicted_mm());
}

// All corners in one strip: none can be held out, and what lies beside it is not known. It is not known perfectly.
TEST(PredictedError, IsNoneWhereNothingCouldBeHeldOut) {
  std::vector<calib::GridCorner> corners;
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t column = i / 2;
    const double x = 10 + 3 * static_cast<double>(column), y = 20 + static_cast<double>(i % 4);
    corners.push_back({i % 2, i / 4, x, y, point<SheetFrame>(x, -y)});
  }
  PlayedScanner played(1, 0);
  const auto any = calibrate(played);
  ASSERT_TRUE(any.ok());
  const calib::ShiftLattice lattice{13, 10, 20, 20};
  calib::MapFit fit;
  fit.poses.resize(2), fit.model = calib::ScannerModel(any->model);
  fit.normal = Eigen::MatrixXd::Identity(2 * lattice.size() + 6, 2 * lattice.size() + 6);
  const std::vector<calib::MapFit> without(2, fit);
  const std::optional<calib::ErrorLattice> predicted =
      calib::predict_scanner_error(corners, lattice, fit, without, kGlassWidth, kGlassHeight,
                                   [&](const std::vector<calib::GridCorner>&) { return fit; });
  EXPECT_FALSE(predicted);
}

TEST(PredictedError, IsNoneWhereTheFitLeavesNoNumber) {
  calib::MachineAxes axes;
  axes.error.everywhere = Millimetres(0.01);
  axes.error.measured = {point<MachineFrame>(50, 50)};
  Box<MachineFrame> reach;
  reach.add({}), reach.add(point<MachineFrame>(100, 100));
  ASSERT_TRUE(calib::predict_axes_error(axes, reach));
  axes.error.open(1, 1) = std::nan("");
  EXPECT_FALSE(calib::predict_axes_error(axes, reach));
}

TEST(PredictedError, OfTheAxesHoldsBetweenTheRingsAndBesideThem) {
  PredictedFigures inside, outside;
  const auto add = [](PredictedFigures& sum, const PredictedFigures& one) {
    sum.places += one.places, sum.within += one.within, sum.by_residual += one.by_residual;
    sum.predicted_sum += one.predicted_sum, sum.squares_sum += one.squares_sum;
  };
  for (const double period : {25.4, 32.0, 40.0})
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      sim::Roughness rough;
      rough.belt_wave_mm = 0.03, rough.belt_period_mm = period, rough.backlash_mm = 0.02;
      const auto figures = play_axes_certificate(seed, rough, RingSpacing::kUneven);
      ASSERT_TRUE(figures.ok()) << "seed " << seed << ": " << figures.error().message;
      add(inside, figures->measured), add(outside, figures->beyond);
    }
  tell("between rings", inside), tell("beside them", outside);
  expect_true(inside, 2), expect_true(outside, 2);
  EXPECT_LT(outside.share_by_residual(), 0.9);
}

}  // namespace
}  // namespace veneer::tests
