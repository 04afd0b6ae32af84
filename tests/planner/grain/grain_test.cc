// Which way grain runs, how calm a picture is, and that the weight of the grain makes it calmer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/files/preview.h"
#include "planner/grain/grain_coherence.h"
#include "planner/grain/grain_field.h"
#include "planner/pictures/features.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::AnyOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

// Lines at an angle (radians, counter-clockwise as people see it from +x), `wave` pixels apart.
cv::Mat lines(int columns, int rows, double angle, double wave = 5) {
  cv::Mat out(rows, columns, CV_8UC3);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      // y is down, so a line that rises as people see it falls in rows.
      const double across = c * std::sin(angle) + r * std::cos(angle);
      out.at<cv::Vec3b>(r, c) =
          cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(128 + 40 * std::sin(2 * kPi * across / wave)));
    }
  return out;
}

double angle_of(const cv::Vec2f& direction) {
  // Twice the angle, with y down.
  const double angle = -std::atan2(direction[1], direction[0]) / 2;
  return angle < -1e-3 ? angle + kPi : angle;
}

TEST(GrainField, FollowsTheLinesOfTheWood) {
  const ScanResolution resolution = ScanResolution::from_dpi(50.8);
  for (const double wanted : {0.0, 0.4, kPi / 2, 2.5}) {
    const cv::Mat field = grain_of_wood(grey_of(lines(80, 60, wanted)), resolution);
    EXPECT_EQ(field.size(), cv::Size(40, 30));
    const cv::Vec2f there = direction_at(field, 20, 15);
    EXPECT_NEAR(std::cos(2 * (angle_of(there) - wanted)), 1, 0.01) << wanted;
    EXPECT_GT(cv::norm(there), 0.8);
  }
  EXPECT_LT(cv::norm(direction_at(grain_of_wood(cv::Mat(60, 80, CV_32FC1, cv::Scalar(0.5)), resolution), 20, 15)),
            1e-3);
}

TEST(GrainField, TurnsWithTheWood) {
  const cv::Vec2f level(1, 0);
  for (const double turn : {0.3, 1.0, kPi / 2, 3.0})
    EXPECT_NEAR(std::cos(2 * (angle_of(turned(level, std::cos(turn), std::sin(turn))) - turn)), 1, 1e-5) << turn;
  EXPECT_NEAR(disagreement(level, turned(level, std::cos(kPi), std::sin(kPi))), 0, 1e-6);
  EXPECT_NEAR(disagreement(level, turned(level, 0, 1)), 1, 1e-6);
  EXPECT_NEAR(disagreement(level, {0, 0}), 0, 1e-9);
}

// A dark and a pale half: in both the grain would like to run along their border, and surer away from it.
TEST(GrainField, APictureWantsGrainAlongItsEdges) {
  cv::Mat grey(120, 120, CV_32FC1, cv::Scalar(0.3));
  grey.colRange(60, 120).setTo(0.7);
  const cv::Mat field = grain_of_picture(grey, ScanResolution::from_dpi(50.8), Millimetres(6));
  for (const double x : {10.0, 22.0, 38.0, 50.0}) EXPECT_NEAR(angle_of(direction_at(field, x, 30)), kPi / 2, 0.1) << x;
  EXPECT_GT(cv::norm(direction_at(field, 10, 30)), cv::norm(direction_at(field, 30, 30)) + 0.2);
}

// Wood with lines in two directions, a strip of each in turn.
StockPanel two_ways() {
  StockPanel panel = test::wood_panel("P", 200, 160, 50.8, 1);
  for (int left = 0; left < 200; left += 40)
    lines(40, 160, left % 80 == 0 ? kPi / 2 : 0.0).copyTo(panel.picture.pixels(cv::Rect(left, 0, 40, 160)));
  return panel;
}

GrainCoherence coherence_of(const Plan& plan, const StockPanel& panel) {
  return grain_coherence(plan, 0, *assemble_preview(plan, 0, {&panel, 1}, ScanResolution::from_dpi(plan.dpi)));
}

TEST(GrainCoherence, IsOneWhereAllRunsOneWayAndLessWherePiecesCross) {
  const StockPanel panel = two_ways();
  Plan plan;
  plan.artworks.push_back({"A", "A", Millimetres(20), Millimetres(10)});
  plan.dpi = 50.8;
  for (int k = 0; k < 2; ++k) {
    Piece& piece = plan.pieces.emplace_back();
    piece.artwork_outline = {point<ArtworkFrame>(10.0 * k, 0), point<ArtworkFrame>(10.0 * k + 10, 0),
                             point<ArtworkFrame>(10.0 * k + 10, 10), point<ArtworkFrame>(10.0 * k, 10)};
    piece.placement = Placement{
        panel.id, Isometry2<PanelFrame, ArtworkFrame>(Radians(0), {Millimetres(4), Millimetres(20.0 + 15 * k)})};
  }
  // Both from strips that run upright: the second is a strip of 20 mm on, and then back.
  plan.pieces[1].placement->panel_from_artwork =
      Isometry2<PanelFrame, ArtworkFrame>(Radians(0), {Millimetres(34), Millimetres(20)});
  EXPECT_NEAR(*coherence_of(plan, panel).mean(), 1, 0.02);
  plan.pieces[1].placement->panel_from_artwork =
      Isometry2<PanelFrame, ArtworkFrame>(Radians(0), {Millimetres(14), Millimetres(20)});
  EXPECT_NEAR(*coherence_of(plan, panel).mean(), -1, 0.02);
  plan.pieces[1].placement.reset();
  EXPECT_FALSE(coherence_of(plan, panel).mean());
}

TEST(GrainWeight, MakesACalmPictureCalmerAndLeavesCostsAsTheyAre) {
  const StockPanel panel = two_ways();
  Artwork artwork = test::blob_artwork("A", 60, 60, Millimetres(30), 3);
  artwork.picture.setTo(cv::Scalar::all(120));
  artwork.picture.colRange(45, 60).setTo(cv::Scalar::all(136));
  PlanOptions options = test::small_options_without_saliency();
  options.patch = Millimetres(5), options.optimize = Optimize::kGlobal, options.rotations = 4, options.w_edge = 0.1;
  const Plan plain = test::planned({artwork}, {panel}, options);
  options.w_grain = 0.5;
  const Plan calm = test::planned({artwork}, {panel}, options);
  EXPECT_EQ(unfilled(calm), 0U);
  EXPECT_GT(*coherence_of(calm, panel).mean(), *coherence_of(plain, panel).mean() + 0.3);
  // What is reported is equation 4 of what is placed, without the grain's.
  EXPECT_LT(cost_total(calm), 3 * cost_total(plain));
  EXPECT_GE(calm.global->greedy_cost, calm.global->cost);
}

TEST(Weights, ThatChangeNothingAreWarnedOf) {
  const StockPanel panel = test::wood_panel("P", 120, 100, 50.8, 1);
  const Artwork artwork = test::blob_artwork("A", 40, 40, Millimetres(20), 3);
  PlanOptions options = test::small_options_without_saliency();
  options.w_grain = 0.2, options.w_gamut = 1;
  const auto warnings = [&] { return test::planned({artwork}, {panel}, options).warnings; };
  EXPECT_THAT(warnings(), IsSupersetOf({HasSubstr("the colour weight is 0"), HasSubstr("pieces choose in turn")}));
  options.w_colour = 0.3, options.optimize = Optimize::kGlobal;
  EXPECT_THAT(warnings(), Each(Not(AnyOf(HasSubstr("colour weight"), HasSubstr("grain")))));
}

}  // namespace
}  // namespace veneer::planner
