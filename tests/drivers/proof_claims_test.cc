#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "drivers/sim/proof/burn_raster.h"
#include "drivers/sim/proof/claims.h"
#include "drivers/sim/proof/rigid.h"

namespace veneer::proof {
namespace {

TEST(Claims, AreReadAsTheCellTellsThem) {
  const auto claims = parse_claims(R"({
    "panels": [{"id": "P-0001", "tags": [200, 201], "width_mm": 290, "height_mm": 210,
      "fiducials": [{"kind": "tag", "tag_id": 200, "face": "show", "x_mm": 12.5, "y_mm": 13},
                    {"kind": "hole", "tag_id": null, "face": "back", "x_mm": 40, "y_mm": 8}],
      "registration": [{"capture": "capture-3", "face": "show", "lattice":
        {"origin_px": [0, 0], "step_px": 64, "cols": 2, "rows": 2, "panel_mm": [[0,10],[10,10],[0,0],[10,0]]}}]}],
    "poses": [{"panel": "P-0001", "sheet_load": 0, "bed_from_panel": [[-1, 0, 300], [0, 1, 20]]}],
    "jobs": [{"job": 4, "preview_file": "p.png", "preview_px_per_mm": 11.8, "width_mm": 28, "height_mm": 14, "pieces": [
      {"id": 1, "mark": "A1-1", "panel": "P-0001", "state": "cut", "artwork_outline_mm": [[0,0],[14,0],[14,14],[0,14],[0,0]],
       "panel_outline_mm": [[1,1],[15,1],[15,15],[1,15]]},
      {"id": 2, "mark": "A1-2", "panel": null, "state": "unfilled", "artwork_outline_mm": [[14,0],[28,0],[28,14],[14,14]]}]}],
    "ledger": [{"panel": "P-0001", "mark": "A1-1", "job": 4, "state": "cut", "outline_mm": [[1,1],[15,1],[15,15],[1,15]],
                "allocation_mm": [[[0.7,0.7],[15.3,0.7],[15.3,15.3],[0.7,15.3]]]},
               {"panel": "P-0001", "mark": "", "job": 0, "state": "scrap", "outline_mm": [],
                "allocation_mm": [[20,20],[21,20],[21,21]]}]})");
  ASSERT_TRUE(claims.ok()) << claims.error().message;
  EXPECT_TRUE(claims->panels[0].fiducials[0].tag);
  EXPECT_FALSE(claims->panels[0].fiducials[1].tag);
  EXPECT_EQ((*claims->jobs)[0].pieces[0].artwork_outline.size(), 4U);  // a repeated first point is no corner
  EXPECT_TRUE((*claims->jobs)[0].pieces[1].panel.empty());
  EXPECT_EQ((*claims->ledger)[0].allocation.at(0).size(), 4U);
  EXPECT_EQ((*claims->ledger)[1].allocation.at(0).size(), 3U);
  EXPECT_EQ((*claims->poses)[0].bed({10, 5}), (Vec2{290, 25}));
  const auto at = claims->panels[0].registration[0].panel_at({32, 16});
  ASSERT_TRUE(at);
  EXPECT_EQ(*at, (Vec2{5, 7.5}));
  EXPECT_FALSE(claims->panels[0].registration[0].panel_at({65, 1}));
}

TEST(Claims, ThatAreNotAsAgreedAreRefused) {
  EXPECT_EQ(parse_claims("{").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(parse_claims(R"({"poses": [{"panel": "P"}]})").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(load_claims("/nowhere/claims.json").error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(parse_claims(R"({"panels": []})")->jobs);
}

TEST(Rigid, IsFittedWithoutScaleOrMirror) {
  Rigid truth = Rigid::turn(0.7);
  truth.shift = {30, -4};
  const std::vector<Vec2> from{{0, 0}, {100, 3}, {40, 70}};
  std::vector<Vec2> to;
  for (const Vec2& p : from) to.push_back(truth(p));
  const auto fit = fit_rigid(from, to);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->sine, std::sin(0.7), 1e-12);
  EXPECT_NEAR(sim::length((*fit)({5, 5}) - truth({5, 5})), 0, 1e-10);
  EXPECT_NEAR(sim::length((*fit * fit->inverse())({5, 5}) - Vec2{5, 5}), 0, 1e-10);
  for (Vec2& p : to) p = p * 1.003;
  const auto scaled = fit_rigid(from, to);
  EXPECT_NEAR(std::hypot(scaled->sine, scaled->cosine), 1, 1e-12);
  EXPECT_FALSE(fit_rigid({{1, 1}}, {{2, 2}}));
}

TEST(BurnRaster, DrawsLinesByPixelCentres) {
  cv::Mat mask(40, 40, CV_8UC1, cv::Scalar(0));
  fill_capsule(mask, {10, 20}, {30, 20}, 3, 255);
  EXPECT_NEAR(cv::countNonZero(mask), 20 * 6 + 3.14159 * 9, 4);
  mask.setTo(0);
  fill_ring(mask, {{5, 5}, {25, 5}, {25, 15}, {5, 15}}, 255);
  EXPECT_EQ(cv::countNonZero(mask), 200);
  fill_capsule(mask, {-50, -50}, {-40, 90}, 3, 255);  // outside is harmless
  EXPECT_EQ(cv::countNonZero(mask), 200);
}

// A piece cut from the back has its show face's edge where the cut is narrowest; the ledger is asked for what is burnt.
TEST(BurnRaster, DrawsACutAsWideAsItIsAtEitherFaceAndAlongItsWay) {
  sim::TrueBurn burn;
  burn.depth = sim::BurnDepth::kThrough, burn.face = sim::SheetFace::kBack, burn.width_mm = 0.4;
  burn.oval_mm = 0.1, burn.taper_mm = 0.2, burn.points = {{2, 2}, {8, 2}, {8, 8}};
  sim::Sheet sheet;
  sheet.burns = {burn};
  const BurnIndex burns(sheet);
  const Window window = Window::around({0, 0}, {10, 10}, 0, 50);
  cv::Mat open(window.rows, window.columns, CV_8UC1, cv::Scalar(0));
  cv::Mat widest = open.clone();
  burns.draw_through(window, open, 1), burns.draw_cut_at_its_widest(window, widest, 1);
  const auto column = static_cast<int>(window.pixel({5, 5}).x), row = static_cast<int>(window.pixel({5, 5}).y);
  EXPECT_NEAR(cv::sum(open.col(column))[0] / 50, 0.2, 0.021) << "along x";
  EXPECT_NEAR(cv::sum(open.row(row))[0] / 50, 0.3, 0.021) << "along y";
  EXPECT_NEAR(cv::sum(widest.col(column))[0] / 50, 0.4, 0.021);
  EXPECT_NEAR(cv::sum(widest.row(row))[0] / 50, 0.5, 0.021);
}

}  // namespace
}  // namespace veneer::proof
