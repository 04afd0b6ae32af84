// Which wood a plan may take, and what is said when there is too little of it.
#include "daemon/plans/plan_stock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/support/stocked_planner.h"

namespace veneer::daemon {
namespace {

using PlanStockTest = testing::StockedPlanner;

// It was planned and reserved, and ended at the bed, where nobody knew the panel.
TEST_F(PlanStockTest, OnlyWoodThatTheCameraFindsIsPlanned) {
  const cv::Mat picture = planner::test::wood_picture(200, 200, 7);
  add_panel("P-0001", 255, picture, false);
  const auto none = plan(small_job());
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kRefused);
  EXPECT_EQ(none.error().message,
            "the camera finds panel P-0001 by the tags on its back, and nobody has scanned them: turn it over and run "
            "veneerctl panel scan --face back --panel P-0001");
  add_panel("P-0002", 255, picture);
  const auto made = plan(small_job());
  ASSERT_TRUE(made.ok()) << made.error().message;
  ASSERT_EQ(made->panels.size(), 1U);
  EXPECT_EQ(made->panels[0].first, PanelId{"P-0002"});
  EXPECT_THAT(made->warnings, ::testing::Contains(::testing::HasSubstr("the wood of panel P-0001 was left out")));
  JobRequest named = small_job();
  named.panels = {PanelId{"P-0001"}, PanelId{"P-0002"}};
  EXPECT_EQ(plan(named).error().code, ErrorCode::kRefused) << "asked for by name";

  JobRequest rare = small_job();
  rare.woods = {"wenge"};
  EXPECT_THAT(plan(rare).error().message, ::testing::HasSubstr("the wood of panel P-0001 was left out"))
      << "it may be the wood that is missing";
}

// Its wood looks different from what was scanned.
TEST_F(PlanStockTest, APanelThatWasSandedAfterItsScanIsNotPlanned) {
  add_panel("P-0001", 255);
  const auto sand = [&] {
    return database_->call([](Repositories& r) {
      db::PanelFacts noted;
      noted.who = "uid 1000", noted.at = "2026-03-01T00:00:00.000Z";
      return r.facts.set_panel({"P-0001"}, noted, {{db::TreatmentKind::kSanding, "grit 240", "2026-02-14", "", ""}});
    });
  };
  const auto before = stored_plan(small_job());
  ASSERT_TRUE(before.ok()) << before.error().message;
  ASSERT_TRUE(sand());
  const std::string why =
      "panel P-0001 was sanded on 2026-02-14, after the scan of 2026-01-01 that counts: scan it again";
  EXPECT_EQ(plan(small_job()).error().message, why);
  EXPECT_EQ(plan(small_job()).error().code, ErrorCode::kRefused);
  const auto job = database_->call([&](Repositories& r) { return r.jobs.create(before->plan, "2026-03-01"); });
  ASSERT_FALSE(job.ok()) << "of a plan from before";
  EXPECT_EQ(job.error().message, why);

  add_panel("P-0002", 255, planner::test::wood_picture(200, 200, 8));
  const auto made = plan(small_job());
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(made->panels.front().first, PanelId{"P-0002"});
  EXPECT_THAT(made->warnings, ::testing::Contains("the wood of panel P-0001 was left out: " + why));
  JobRequest named = small_job();
  named.panels = {PanelId{"P-0001"}};
  EXPECT_EQ(plan(named).error().message, why) << "asked for by name";

  const auto scanned = database_->call([](Repositories& r) {
    const auto panel = r.panels.find({"P-0001"});
    return r.panels.add_mask({"P-0001"}, {0, panel->map_file + "x", panel->mask_file, "", "2026-02-15T00:00:00.000Z"},
                             1);
  });
  ASSERT_TRUE(scanned.ok());
  EXPECT_TRUE(database_->call([](Repositories& r) { return r.facts.check_surface({"P-0001"}); }));
}

TEST_F(PlanStockTest, ARetiredPanelIsNotPlanned) {
  add_panel("P-0001", 255);
  add_panel("P-0002", 255);
  ASSERT_TRUE(database_->call(
      [](Repositories& r) { return r.panels.retire(PanelId{"P-0001"}, "split", "2026-01-02T00:00:00.000Z"); }));
  const auto made = plan(small_job());
  ASSERT_TRUE(made.ok()) << made.error().message;
  ASSERT_EQ(made->panels.size(), 1U);
  EXPECT_EQ(made->panels[0].first, PanelId{"P-0002"});
  JobRequest named = small_job();
  named.panels = {PanelId{"P-0001"}};
  const auto refused = plan(named);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("P-0001 was retired (split)"));

  // A plan that forbids some of its wood, made while it was in stock, can be changed all the same.
  JobRequest spared = small_job();
  spared.forbidden = {*planner::forbidden_wood("P-0001,1,1,5,5")};
  EXPECT_TRUE(plan(spared).ok());
  spared.forbidden = {*planner::forbidden_wood("P-0099,1,1,5,5")};
  EXPECT_EQ(plan(spared).error().code, ErrorCode::kNotFound);
}

TEST_F(PlanStockTest, TooLittleWoodIsToldByItsTonesAndWithASizeThatFits) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.size = Millimetres(20), request.options.patch = Millimetres(10);
  const auto job = plan(request);
  ASSERT_FALSE(job.ok());
  EXPECT_EQ(job.error().code, ErrorCode::kRefused);
  EXPECT_THAT(
      job.error().message,
      ::testing::MatchesRegex("nothing is reserved: no free wood was left for 3 of 4 patches "
                              "\\(([0-9]+ mm2 (rather )?(dark|pale)(, )?)+\\): it fits with its shorter side [0-9]+ "
                              "mm and patches of [0-9.]+ mm(, or [0-9]+ mm and patches of [0-9.]+ mm)?, which was "
                              "tried; or add a panel"));
  EXPECT_EQ(jobs(), 0U);
  // Somebody takes the cell at its word.
  double size = 0, patch = 0;
  const std::string& said = job.error().message;
  ASSERT_EQ(std::sscanf(said.c_str() + said.find("with its"), "with its shorter side %lf mm and patches of %lf mm",
                        &size, &patch),
            2);
  EXPECT_LT(size, 20);
  JobRequest chosen = request;
  chosen.remnants_first = true;
  EXPECT_THAT(plan(chosen).error().message, ::testing::HasSubstr(": try it with its shorter side"))
      << "for a smaller picture other panels may be chosen";
  request.size = Millimetres(size), request.options.patch = Millimetres(patch);
  const auto smaller = plan(request);
  EXPECT_TRUE(smaller.ok()) << smaller.error().message;
}

TEST_F(PlanStockTest, TooLittleWoodForWhateverIsTriedIsToldWithoutASize) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.size = Millimetres(300), request.options.patch = Millimetres(16), request.options.dpi = 60;
  const auto job = plan(request);
  ASSERT_FALSE(job.ok());
  EXPECT_EQ(job.error().code, ErrorCode::kRefused);
  EXPECT_THAT(job.error().message,
              ::testing::HasSubstr("no smaller size or patches were found in which it fits, so add a panel"));
}

TEST_F(PlanStockTest, WoodThatAPlanLeasesIsForItsOwnChangesAlone) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto first = stored_plan(small_job());
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto lease = [&](const std::string& until) {
    return database_->call(
        [&](Repositories& r) { return r.leases.take(first->plan, "uid 1000", "2026-01-01T00:00:00.000Z", until); });
  };
  ASSERT_TRUE(lease("2999-01-01T00:00:00.000Z").ok());
  const auto leased = pieces_of(first->plan);
  const auto overlap = [&](db::PlanId plan) {
    int count = 0;
    for (const auto& [mark, piece] : pieces_of(plan))
      for (const auto& [other, own] : leased)
        if (piece.panel && overlaps(piece.allocation, own.allocation)) ++count;
    return count;
  };
  const auto second = stored_plan(small_job());
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(overlap(second->plan), 0);

  PlanService::Change change;
  change.plan = first->plan;
  change.edits.replanned = {"A1-1"};
  const auto third = changed(change);
  ASSERT_TRUE(third.ok()) << third.error().message;
  for (const auto& [mark, piece] : pieces_of(third->plan))
    EXPECT_TRUE(mark == "A1-1" || piece.panel_outline == leased.at(mark).panel_outline) << mark;

  // A lease that is over ends when somebody plans.
  ASSERT_TRUE(lease("2026-01-02T00:00:00.000Z").ok());
  const auto fourth = stored_plan(small_job());
  ASSERT_TRUE(fourth.ok()) << fourth.error().message;
  EXPECT_GT(overlap(fourth->plan), 0);
}

TEST_F(PlanStockTest, NoMorePanelsThanAllowedAreThoseWithTheMostFreeWood) {
  add_panel("P-0001", 255, cv::Mat(160, 160, CV_8UC3, cv::Scalar::all(50)));
  add_panel("P-0002", 255, cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(200)));
  JobRequest request = two_tone_job();
  const auto both = plan(request);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_EQ(both->panels.size(), 2U);
  request.max_panels = 1;
  const auto one = plan(request);
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_THAT(one->panels, ::testing::ElementsAre(std::pair(PanelId{"P-0002"}, std::size_t{4})));
}

TEST_F(PlanStockTest, RemnantsComeBeforeFreshPanelsUnlessTheyHaveTooLittleWood) {
  add_panel("P-0001", 255, cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(200)));
  add_panel("P-0002", 255, cv::Mat(180, 180, CV_8UC3, cv::Scalar::all(200)));
  add_panel("P-0003", 255, cv::Mat(180, 180, CV_8UC3, cv::Scalar::all(200)));
  const auto write_off = [&](const char* panel, Millimetres height) {
    const Ring<PanelFrame> strip{{0_mm, 0_mm}, {17_mm, 0_mm}, {17_mm, height}, {0_mm, height}};
    return database_->call([&](Repositories& r) {
      return r.ledger.write_off(PanelId{panel}, Region<PanelFrame>(strip), "test", "2026-01-01T00:00:00.000Z");
    });
  };
  ASSERT_TRUE(write_off("P-0002", 2_mm).ok());
  ASSERT_TRUE(write_off("P-0003", 13_mm).ok());
  JobRequest request = small_job();
  request.max_panels = 1;
  const auto panels_of = [&] {
    const auto job = plan(request);
    EXPECT_TRUE(job.ok()) << job.error().message;
    std::vector<PanelId> out;
    for (const auto& [panel, pieces] : job->panels) out.push_back(panel);
    return out;
  };
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0001"})) << "nobody asked for remnants";
  request.remnants_first = false;
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0001"}));
  request.remnants_first = true;
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0002"})) << "of remnants the fullest";
  request.panels = {PanelId{"P-0001"}, PanelId{"P-0003"}};
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0001"})) << "the strip that is left is too little wood";

  request.max_panels.reset(), request.panels.clear();
  EXPECT_THAT(panels_of(), ::testing::Each(::testing::Ne(PanelId{"P-0001"}))) << "no number of panels is asked for";
  request.panels = {PanelId{"P-0001"}, PanelId{"P-0003"}};
  EXPECT_THAT(panels_of(), ::testing::Contains(PanelId{"P-0001"})) << "a fresh one, for want of remnants";
}

TEST_F(PlanStockTest, OnlyTheWoodThatIsAskedForIsUsedZoneByZone) {
  cv::Mat wood(240, 240, CV_8UC3, cv::Scalar::all(200));
  wood(cv::Rect(0, 0, 120, 240)).setTo(cv::Scalar::all(50));
  add_panel("P-0001", 255, wood);
  add_zone("P-0001", 0_mm, Millimetres(10.2), "walnut");
  add_zone("P-0001", Millimetres(10.1), Millimetres(20.4), "maple");  // hulls of older schemas reach into others
  store_zones();
  JobRequest request = two_tone_job();
  request.woods = {"maple"};
  const auto job = plan(request);
  ASSERT_TRUE(job.ok()) << job.error().message;
  const auto pieces = database_->call([&](Repositories& r) { return r.jobs.pieces(job->job); });
  for (const auto& piece : *pieces) EXPECT_GT(bounds(piece.panel_outline).min.x.count(), 10.2) << piece.mark;
  EXPECT_LT(job->cost_per_pixel, 1e-3) << "mapped to the tones of maple alone";
  request.woods = {"maple", "oak"};
  const auto none = plan(request);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().message, "no panel has oak: there is maple, walnut");
}

TEST_F(PlanStockTest, ForbiddenWoodStaysWhole) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  for (const char* half : {"P-0001,0,0,8.5,17", "P-0001,8.5,0,8.5,17"}) {
    const auto wood = planner::forbidden_wood(half);
    ASSERT_TRUE(wood.ok()) << wood.error().message;
    request.forbidden = {*wood};
    const auto job = plan(request);
    ASSERT_TRUE(job.ok()) << job.error().message;
    const auto pieces = database_->call([&](Repositories& r) { return r.jobs.pieces(job->job); });
    for (const auto& piece : *pieces) {
      const Box<PanelFrame> box = bounds(piece.panel_outline);
      EXPECT_TRUE(box.min.x > wood->region.max.x || box.max.x < wood->region.min.x) << half << ": " << piece.mark;
    }
  }
  request.forbidden.front().panel = PanelId{"P-0002"};
  const auto none = plan(request);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().message, "there is no panel P-0002 to forbid wood on");
}

TEST_F(PlanStockTest, AWoodThatIsGivenNoWeightLeavesNoTones) {
  add_panel("P-0001", 255, cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(50)));
  add_panel("P-0002", 255, cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(200)));
  add_zone("P-0001", 0_mm, 20_mm, "walnut");
  add_zone("P-0002", 0_mm, 20_mm, "maple");
  store_zones();
  JobRequest request = two_tone_job();
  request.wood_weights = {{"walnut", 0}};
  const auto job = plan(request);
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_THAT(job->panels, ::testing::ElementsAre(std::pair(PanelId{"P-0002"}, std::size_t{4})));
  request.wood_weights = {{"oak", 2}};
  const auto none = plan(request);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().message, "no panel is oak: choose from maple, walnut");
}

TEST_F(PlanStockTest, AWoodThatIsGivenNoWeightLeavesNoTonesWhereItIsOnePartOfAPanel) {
  cv::Mat wood(240, 240, CV_8UC3, cv::Scalar::all(200));
  wood(cv::Rect(0, 0, 120, 240)).setTo(cv::Scalar::all(50));
  add_panel("P-0001", 255, wood);
  add_zone("P-0001", 0_mm, Millimetres(10.16), "walnut");
  add_zone("P-0001", Millimetres(10.16), Millimetres(20.4), "maple");
  JobRequest request = two_tone_job();
  request.wood_weights = {{"walnut", 0}};
  const auto expect_pale = [&](const char* why) {
    const auto job = plan(request);
    ASSERT_TRUE(job.ok()) << job.error().message;
    EXPECT_THAT(job->panels, ::testing::ElementsAre(std::pair(PanelId{"P-0001"}, std::size_t{4}))) << why;
    const auto pieces = database_->call([&](Repositories& r) { return r.jobs.pieces(job->job); });
    for (const auto& piece : *pieces) EXPECT_GT(bounds(piece.panel_outline).min.x.count(), 10.1) << why << piece.mark;
  };
  // Beside it a panel that is all of that wood, which alone would be weighed.
  add_panel("P-0002", 255, cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(50)));
  add_zone("P-0002", 0_mm, 20_mm, "walnut");
  store_zones();
  request.panels = {PanelId{"P-0001"}};
  expect_pale("alone: ");
  request.panels = {PanelId{"P-0001"}, PanelId{"P-0002"}};
  expect_pale("beside walnut alone: ");
}

// Half of the panel is dark, half of it pale, and so is the picture.
TEST_F(PlanStockTest, WoodThatAnEarlierJobHasBookedGivesALaterOneNeitherTonesNorPieces) {
  cv::Mat wood(240, 240, CV_8UC3, cv::Scalar::all(200));
  wood(cv::Rect(0, 0, 120, 240)).setTo(cv::Scalar::all(50));
  add_panel("P-0001", 255, wood);
  JobRequest request = two_tone_job();
  const Millimetres middle = ScanResolution::from_dpi(300).to_mm(Pixels(120));
  const auto dark_pieces = [&](JobId job) {
    const auto pieces = database_->call([&](Repositories& r) { return r.jobs.pieces(job); });
    return std::count_if(pieces->begin(), pieces->end(), [&](const db::PieceRecord& piece) {
      const Box<PanelFrame> box = bounds(piece.panel_outline);
      return (box.min.x + box.max.x) / 2 < middle;
    });
  };
  const auto before = plan(request);
  ASSERT_TRUE(before.ok()) << before.error().message;
  EXPECT_EQ(dark_pieces(before->job), 2);

  db::PlannedPatch all_dark;
  all_dark.mark = "A1-1";
  all_dark.panel = PanelId{"P-0002"};
  all_dark.artwork_outline = {point<ArtworkFrame>(0, 0), {middle, 0_mm}, {middle, 2 * middle}, {0_mm, 2 * middle}};
  all_dark.panel_outline = {point<PanelFrame>(0, 0), {middle, 0_mm}, {middle, 2 * middle}, {0_mm, 2 * middle}};
  all_dark.allocation = Region<PanelFrame>(all_dark.panel_outline);
  db::NewPlan booked;
  booked.name = "all that is dark";
  booked.pieces = {all_dark};
  booked.planned_on = {{PanelId{"P-0002"}, 1}};
  add_panel("P-0002", 255, wood);
  ASSERT_TRUE(database_->call([&](Repositories& r) { return r.jobs.create(booked, "2026-01-01T00:00:00.000Z"); }).ok());
  request.panels = {PanelId{"P-0002"}};
  const auto after = plan(request);
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_EQ(dark_pieces(after->job), 0);
  EXPECT_LT(after->cost_per_pixel, 1e-3) << "the picture's dark half is mapped to pale wood, the only wood there is";
  request.options.w_hist = 0;
  const auto unmapped = plan(request);
  ASSERT_TRUE(unmapped.ok()) << unmapped.error().message;
  EXPECT_GT(unmapped->cost_per_pixel, 0.05);
}

}  // namespace
}  // namespace veneer::daemon
