// Plans and jobs: what is stored and what is not, changes, pieces that are made again.
#include "daemon/plans/plan_service.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <future>

#include "daemon/routes/cell_json.h"
#include "planner/files/plan_files.h"
#include "planner/plan_options.h"
#include "tests/support/stocked_planner.h"

namespace veneer::daemon {
namespace {

using PlanServiceTest = testing::StockedPlanner;

TEST_F(PlanServiceTest, RemovesTheIndexesOfPanelsThatAreUsedUpOrGone) {
  add_panel("P-0001", 0);
  add_panel("P-0002", 255);
  const auto used_up = leave_index("P-0001"), in_stock = leave_index("P-0002"), gone = leave_index("P-0000");
  const auto job = plan(small_job());
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_FALSE(std::filesystem::exists(used_up));
  EXPECT_FALSE(std::filesystem::exists(gone));
  EXPECT_TRUE(std::filesystem::exists(in_stock));
  EXPECT_TRUE(std::filesystem::exists(library_.index_dir() / "P-0002-0-1.index")) << "what this plan measured";
}

// No wood, no kerf and no database: only the picture is looked at.
TEST_F(PlanServiceTest, AGridsLinesNeedNoWoodAndStoreNothing) {
  JobRequest wanted = small_job();
  wanted.options.layout = planner::LayoutKind::kMorph;
  wanted.pinned_vertices = "1,1,3.5,2.6";
  for (const bool fine : {false, true}) {
    const auto grid = service().sketch_grid(wanted, fine, {});
    ASSERT_TRUE(grid.ok()) << grid.error().message;
    EXPECT_EQ(grid->rows, 2);
    EXPECT_EQ(grid->columns, 2);
    ASSERT_EQ(grid->vertices.size(), 9U);
    EXPECT_NEAR(grid->vertices[4][0], 3.5, 0.02) << fine;
    EXPECT_NEAR(grid->vertices[4][1], 2.6, 0.02) << fine;
    EXPECT_EQ(grid->lines.size(), 2U);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "targets"));
  EXPECT_FALSE(std::filesystem::is_empty(library_.edges_dir())) << "but its edges, for the next look at it";
  wanted.pinned_vertices = "1,1,6,6";
  const auto refused = service().sketch_grid(wanted, false, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("too far from where the straight grid has it"));
}

TEST_F(PlanServiceTest, AMosaicsCellsNeedNoWoodAndStoreNothing) {
  JobRequest wanted = small_job();
  wanted.options.layout = planner::LayoutKind::kMosaic;
  wanted.cell_sizes = "2x2:ff00";
  wanted.flow_lines = "0,3000 10000,3000";
  for (const bool fine : {false, true}) {
    const auto drawn = service().sketch_mosaic(wanted, fine, {});
    ASSERT_TRUE(drawn.ok()) << drawn.error().message;
    EXPECT_GE(drawn->cells, 2U);
    EXPECT_GE(drawn->lines.size(), 1U);
    for (const auto& line : drawn->lines)
      for (const auto& [x, y] : line) EXPECT_TRUE(x >= 0 && x <= drawn->width_mm && y >= 0 && y <= drawn->height_mm);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "targets"));
  wanted.cell_sizes = "2x2:ffff";
  const auto refused = service().sketch_mosaic(wanted, false, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("white everywhere"));
}

TEST_F(PlanServiceTest, ASketchStoresNothingAndSeesWhatIsBookedSince) {
  add_panel("P-0001", 255);
  const auto sketched = [&] {
    auto reader = database_->open_reader();
    return service().sketch(small_job(), false, (*reader)->repositories(), {});
  };
  const auto first = sketched();
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_EQ(first->pieces, 4U);
  EXPECT_EQ(first->unfilled, 0U);
  EXPECT_EQ(first->layout, "grid");
  EXPECT_TRUE(first->preview.starts_with("/9j/")) << "a JPEG file in base64";
  EXPECT_TRUE(first->remarks.empty());
  EXPECT_TRUE(database_->call([](Repositories& r) { return r.plans.list({}, 10, false); })->empty());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "targets"));
  EXPECT_FALSE(std::filesystem::is_empty(library_.index_dir())) << "what the next one needs of the wood";
  const auto again = sketched();
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->preview, first->preview);

  JobRequest large = small_job();
  large.size = Millimetres(9);
  const auto booked = plan(large);
  ASSERT_TRUE(booked.ok()) << booked.error().message;
  const auto after = sketched();
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_NE(after->preview, first->preview) << "other wood";
}

TEST_F(PlanServiceTest, AFineSketchHasThePlansOwnPiecesAndHeedsItsGuides) {
  add_panel("P-0001", 255);
  const auto sketched = [&](const JobRequest& wanted, bool fine) {
    auto reader = database_->open_reader();
    return service().sketch(wanted, fine, (*reader)->repositories(), {});
  };
  JobRequest wanted = small_job();
  wanted.options.layout = planner::LayoutKind::kMorph;
  const auto squares = sketched(wanted, false), straight = sketched(wanted, true);
  ASSERT_TRUE(squares.ok() && straight.ok());
  EXPECT_EQ(squares->layout, "grid");
  EXPECT_EQ(straight->layout, "morph");
  wanted.pinned_vertices = "1,1,3.5,2.6";
  const auto pinned = sketched(wanted, true);
  ASSERT_TRUE(pinned.ok()) << pinned.error().message;
  EXPECT_NE(pinned->preview, straight->preview);
  wanted.pinned_vertices = "1,1,6,6";
  EXPECT_THAT(sketched(wanted, true).error().message, ::testing::HasSubstr("too far from where the straight grid"));
}

class NeverInTime final : public WorkRunner {
 public:
  Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress&, std::stop_token) override {
    return Error{ErrorCode::kTimeout, order.what + " took too long"};
  }
};

// Asked again, the wood is there already; the plan's own pieces take as long as before.
TEST_F(PlanServiceTest, ASketchThatTakesTooLongSaysWhatMakesItQuicker) {
  add_panel("P-0001", 255);
  NeverInTime late;
  const auto sketched = [&](bool fine) {
    auto reader = database_->open_reader();
    return PlanService(*database_, library_, late, config_, make_null_logger())
        .sketch(small_job(), fine, (*reader)->repositories(), {});
  };
  const auto squares = sketched(false), fine = sketched(true);
  ASSERT_FALSE(squares.ok() || fine.ok());
  EXPECT_EQ(fine.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(squares.error().message,
            "the sketch took longer than 30 s: ask again, since what was read of the wood is kept");
  EXPECT_EQ(fine.error().message,
            "the sketch in the plan's own pieces took longer than 30 s: choose larger pieces or a smaller picture, or "
            "look at it in squares");
}

// One of a finished picture's pieces is lost; the panel was scanned since, and is full of holes.
TEST_F(PlanServiceTest, MakesALostPieceAgainFromWhatIsLeft) {
  add_panel("P-0001", 255);
  const auto made = plan(small_job());
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto pieces = [&] { return *database_->call([&](Repositories& r) { return r.jobs.pieces(made->job); }); };
  const auto report = *database_->call([&](Repositories& r) { return r.plans.find(r.jobs.find(made->job)->plan); });
  EXPECT_GT(nlohmann::json::parse(report.report_json)["cutting_s"], 1) << "what the console tells of a plan";
  const auto before = pieces();
  const auto redo = [&](const std::vector<std::string>& marks, bool lost = false) {
    return service().redo({made->job, marks, 1, lost}, "uid 1000", [](double, const std::string&) {}, {});
  };
  EXPECT_THAT(redo({}).error().message, ::testing::HasSubstr("no piece of job 1 is missing"));
  EXPECT_THAT(redo({before[0].mark}).error().message, ::testing::HasSubstr("still to be cut"));
  EXPECT_EQ(redo({"Z9"}).error().code, ErrorCode::kNotFound);

  const std::string now = "2026-01-02T00:00:00.000Z";
  ASSERT_TRUE(database_->call([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(made->job, PanelId{"P-0001"}, {}, 0.01_mm, now);
    if (!run) return run.error();
    for (const auto& piece : before) {
      if (Status cutting = r.jobs.mark_cutting(piece.id, now); !cutting) return cutting;
      if (Status cut = r.jobs.book_piece(piece.id, now); !cut) return cut;
    }
    return r.jobs.finish_run(*run, false, now);
  }));
  // The new scan sees holes, as bright as the lid, and calls nothing of the left third usable.
  const auto record = *database_->call([](Repositories& r) { return r.panels.find(PanelId{"P-0001"}); });
  cv::Mat bright(200, 200, CV_8UC3, cv::Scalar::all(250)), mask(200, 200, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 60, 200)).setTo(0);
  const auto map_file = library_.store_picture(bright, "panels/P-0001", "map");
  const auto mask_file = library_.store_picture(mask, "panels/P-0001", "mask");
  ASSERT_TRUE(map_file.ok() && mask_file.ok());
  ASSERT_TRUE(database_->call([&](Repositories& r) -> Status {
    const auto version =
        r.panels.add_mask(PanelId{"P-0001"}, {0, map_file->file, mask_file->file, map_file->sha256, now}, 1);
    return version ? Ok() : Status(version.error());
  }));

  const auto good = redo({before[1].mark});
  ASSERT_FALSE(good.ok());
  EXPECT_EQ(good.error().code, ErrorCode::kConflict);
  EXPECT_THAT(good.error().message, ::testing::HasSubstr("veneerctl job redo 1 " + before[1].mark + " --lost"));
  EXPECT_EQ(pieces()[1].state, db::PieceState::kCut);
  const auto done = redo({before[1].mark}, true);
  ASSERT_TRUE(done.ok()) << done.error().message;
  ASSERT_EQ(done->redone.size(), 1U);
  EXPECT_EQ(done->redone[0].mark, before[1].mark);
  ASSERT_TRUE(done->redone[0].cost_before);
  EXPECT_GE(done->redone[0].cost, *done->redone[0].cost_before);
  EXPECT_LT(done->redone[0].cost, 0.2) << "matched against wood, not against holes";
  EXPECT_GE(done->cost_per_pixel, done->cost_before);
  EXPECT_NEAR(done->cost_before, made->cost_per_pixel, 1e-9);

  const auto after = pieces();
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].id, before[i].id);
    EXPECT_EQ(after[i].mark, before[i].mark);
    EXPECT_EQ(after[i].state, i == 1 ? db::PieceState::kReserved : db::PieceState::kCut);
    EXPECT_EQ(after[i].panel_outline == before[i].panel_outline, i != 1);
  }
  for (const auto& corner : after[1].panel_outline)
    EXPECT_GT(corner.x, ScanResolution::from_dpi(300).to_mm(Pixels(60))) << "where the new mask sees wood";
  const auto job = *database_->call([&](Repositories& r) { return r.jobs.find(made->job); });
  EXPECT_EQ(job.state, db::JobState::kStopped);

  // A panel that left the stock keeps its pieces in the picture, and gives no more wood.
  ASSERT_TRUE(database_->call([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(made->job, PanelId{"P-0001"}, {}, 0.01_mm, now);
    if (!run) return run.error();
    if (Status cutting = r.jobs.mark_cutting(after[1].id, now); !cutting) return cutting;
    if (Status cut = r.jobs.book_piece(after[1].id, now); !cut) return cut;
    if (Status over = r.jobs.finish_run(*run, false, now); !over) return over;
    return r.panels.retire(PanelId{"P-0001"}, "split", now);
  }));
  EXPECT_EQ(redo({before[2].mark}, true).error().code, ErrorCode::kRefused) << "no panel in stock";
  add_panel("P-0002", 255);
  const auto elsewhere = redo({before[2].mark, before[1].mark}, true);
  ASSERT_TRUE(elsewhere.ok()) << elsewhere.error().message;
  EXPECT_EQ(elsewhere->redone.size(), 2U);
  for (const std::size_t i : {1U, 2U}) EXPECT_EQ(pieces()[i].panel, PanelId{"P-0002"});
}

// What redo of a whole job is asked for: one piece was spoilt, of another the wood is whole, and the third is good.
TEST_F(PlanServiceTest, MakesAllThatIsMissingAgainAndNothingElse) {
  add_panel("P-0001", 255);
  const auto made = plan(small_job());
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto pieces = [&] { return *database_->call([&](Repositories& r) { return r.jobs.pieces(made->job); }); };
  const auto before = pieces();
  ASSERT_EQ(before.size(), 4U);
  const std::string now = "2026-01-02T00:00:00.000Z";
  const Status settled = database_->call([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(made->job, PanelId{"P-0001"}, {}, 0.01_mm, now);
    if (!run) return run.error();
    for (const auto& piece : before) {
      if (Status cutting = r.jobs.mark_cutting(piece.id, now); !cutting) return cutting;
      if (Status cut = r.jobs.book_piece(piece.id, now); !cut) return cut;
    }
    if (Status over = r.jobs.finish_run(*run, false, now); !over) return over;
    const std::vector<PieceId> doubted{before[0].id, before[1].id, before[2].id};
    if (Status suspect = r.jobs.make_suspect(doubted, now); !suspect) return suspect;
    if (Status lost = r.jobs.settle(before[0].id, db::AllocationState::kScrap, now, "user anna"); !lost) return lost;
    if (Status whole = r.jobs.settle(before[1].id, db::AllocationState::kReleased, now, "user anna"); !whole)
      return whole;
    return r.jobs.settle(before[2].id, db::AllocationState::kCut, now, "user anna");
  });
  ASSERT_TRUE(settled.ok()) << settled.error().message;

  const auto done = service().redo({made->job, {}, 1}, "uid 1000", [](double, const std::string&) {}, {});
  ASSERT_TRUE(done.ok()) << done.error().message;
  std::vector<std::string> marks;
  for (const auto& piece : done->redone) marks.push_back(piece.mark);
  EXPECT_THAT(marks, ::testing::UnorderedElementsAre(before[0].mark, before[1].mark));
  const auto after = pieces();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].id, before[i].id);
    EXPECT_EQ(after[i].mark, before[i].mark);
    EXPECT_EQ(after[i].state, i < 2 ? db::PieceState::kReserved : db::PieceState::kCut) << before[i].mark;
    EXPECT_TRUE(i < 2 || after[i].panel_outline == before[i].panel_outline) << before[i].mark;
  }
}

TEST_F(PlanServiceTest, ReservesPiecesThatLieBetweenTheRotations) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.options.fine_rotation = true;
  const auto job = plan(request);
  ASSERT_TRUE(job.ok()) << job.error().message;
  const auto pieces = database_->call([&](Repositories& r) { return r.jobs.pieces(job->job); });
  ASSERT_TRUE(pieces.ok());
  EXPECT_GT(to_json(*job)["fine_rotation"]["moved"], 0);
  EXPECT_TRUE(to_json(*job)["global"].is_null());
  std::size_t between = 0;
  for (const auto& piece : *pieces) {
    ASSERT_TRUE(piece.panel);
    between += std::abs(std::sin(piece.panel_from_artwork.angle().count())) > 1e-3 ? 1 : 0;
    for (std::size_t i = 0; i < piece.artwork_outline.size(); ++i)
      EXPECT_LT(distance(piece.panel_outline[i], piece.panel_from_artwork * piece.artwork_outline[i]).count(), 1e-3);
  }
  EXPECT_GT(between, 0U);
}

TEST_F(PlanServiceTest, OptionsArriveAtThePlanner) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.options.alternatives = 3, request.options.optimize = planner::Optimize::kGlobal;
  request.options.patch = Millimetres(1.5), request.options.adaptive_levels = 1, request.options.adaptive_factor = 1e6;
  const auto job = plan(request);
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(job->pieces, 4U) << "so large a factor makes the largest patches there are";
  const auto text = database_->call([&](Repositories& r) { return r.jobs.plan_json(job->job); });
  ASSERT_TRUE(text.ok());
  const auto read = planner::plan_from_json(*text);
  ASSERT_TRUE(read.ok()) << read.error().message;
  for (const auto& piece : read->pieces) EXPECT_EQ(piece.alternatives.size(), 3U) << piece.mark;
  const auto record = database_->call([&](Repositories& r) { return r.jobs.find(job->job); });
  const auto kept = nlohmann::json::parse(record->options_json);
  EXPECT_EQ(kept["optimize"], "global");
  EXPECT_EQ(kept["alternatives"], 3);
  EXPECT_EQ(kept["kerf_mm"], 0.1);
  const nlohmann::json told = to_json(*job);
  ASSERT_TRUE(told["global"].is_object());
  EXPECT_GT(told["global"]["greedy_cost"], 0);
  EXPECT_LE(told["global"]["cost"], told["global"]["greedy_cost"]);
  EXPECT_TRUE(told["fine_rotation"].is_null());
}

TEST_F(PlanServiceTest, AdviceIsGivenFromTheFreeWoodAndKeepsNothing) {
  add_panel("P-0001", 255, planner::test::wood_picture(420, 420, 7));
  JobRequest request = small_job();
  request.size = Millimetres(20);
  const auto given = service().advise(request, [](double, const std::string&) {}, {});
  ASSERT_TRUE(given.ok()) << given.error().message;
  ASSERT_FALSE(given->suggestions.empty());
  ASSERT_TRUE(given->suggested);
  for (const AdvisedPicture& it : given->suggestions) {
    EXPECT_LE(it.size_mm, 20);
    EXPECT_GE(it.pieces, 9U);
    EXPECT_EQ(it.preview.substr(0, 4), "/9j/") << "a JPEG file";
    EXPECT_EQ(it.preview.size() % 4, 0U);
  }
  EXPECT_EQ(database_->call([](Repositories& r) { return r.plans.list(); })->size(), 0U);
  // A suggestion is planned as it was suggested.
  const AdvisedPicture& last = given->suggestions.back();
  request.crop = last.crop, request.size = Millimetres(last.size_mm),
  request.options.patch = Millimetres(last.patch_mm);
  ASSERT_TRUE(planner::set_option(request.options, "layout", last.layout).ok());
  const auto planned = stored_plan(request);
  ASSERT_TRUE(planned.ok()) << planned.error().message;
  EXPECT_EQ(planned->pieces, last.pieces);
  // Only what is asked for is looked at.
  request.crop = "2,3,16,16";
  const auto of_crop = service().advise(request, [](double, const std::string&) {}, {});
  ASSERT_TRUE(of_crop.ok()) << of_crop.error().message;
  EXPECT_FALSE(of_crop->suggestions.empty());
  for (const AdvisedPicture& it : of_crop->suggestions) EXPECT_EQ(it.crop, request.crop);
  request.crop = "15,15,10,10";
  EXPECT_EQ(service().advise(request, [](double, const std::string&) {}, {}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(stored_plan(request).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(PlanServiceTest, APlainPictureIsWarnedOf) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.options.patch = request.size;  // room for its mark
  const auto detailed = plan(request);
  ASSERT_TRUE(detailed.ok()) << detailed.error().message;
  EXPECT_THAT(to_json(*detailed)["warnings"], ::testing::IsEmpty());
  request.files = png(cv::Mat(20, 20, CV_8UC3, cv::Scalar::all(120)));
  const auto plain = plan(request);
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  EXPECT_THAT(to_json(*plain)["warnings"], ::testing::ElementsAre("\"test\" is one plain tone, so there is nothing in "
                                                                  "it to rebuild: is it the right picture?"));
}

TEST_F(PlanServiceTest, PiecesWithoutRoomForTheirMarksAreToldWhenTheyArePlanned) {
  add_panel("P-0001", 255);
  JobRequest request = refined_job();
  request.options.min_size = Millimetres(3);  // refined, a piece of 6 mm may be smaller than one of 5
  const auto roomy = stored_plan(request);
  ASSERT_TRUE(roomy.ok()) << roomy.error().message;
  EXPECT_THAT(to_json(*roomy)["warnings"], ::testing::IsEmpty());
  request.size = Millimetres(6);
  request.options.patch = Millimetres(2), request.options.min_width = Millimetres(0.5);
  const auto small = stored_plan(request);
  ASSERT_TRUE(small.ok()) << small.error().message;
  EXPECT_THAT(to_json(*small)["warnings"].dump(), ::testing::HasSubstr("marks do not fit on their pieces at 1.4 mm"));
}

// Says when the work is asked for.
class Announced final : public WorkRunner {
 public:
  explicit Announced(WorkRunner& then) : then_(then) {}
  Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress& progress, std::stop_token stop) override {
    asked_.set_value();
    return then_.run(order, progress, std::move(stop));
  }
  bool asked_within(std::chrono::seconds wait) {
    return asked_.get_future().wait_for(wait) == std::future_status::ready;
  }

 private:
  WorkRunner& then_;
  std::promise<void> asked_;
};

TEST_F(PlanServiceTest, TheThreadThatWritesIsNotAskedForTheWood) {
  add_panel("P-0001", 255);
  Announced announced(workers_);
  std::promise<void> written;
  database_->async([wait = written.get_future().share()](Repositories&) { return wait.wait(), 0; }, [](int) {});
  auto planning = std::async(std::launch::async, [&] {
    return PlanService(*database_, library_, announced, config_, make_null_logger())
        .make_job(small_job(), "local:1000", [](double, const std::string&) {}, {});
  });
  EXPECT_TRUE(announced.asked_within(std::chrono::seconds(10))) << "while a write takes its time";
  written.set_value();
  const auto job = planning.get();
  EXPECT_TRUE(job.ok()) << job.error().message;
}

// Whoever cancels a job wants nothing of it, not even a plan that is whole by then.
TEST_F(PlanServiceTest, ACancelledJobReservesNothingHoweverFarItIs) {
  add_panel("P-0001", 255);
  for (const std::string at : {"placed 4 of 4 pieces", "reserving the wood"}) {
    std::stop_source stop;
    bool reached = false;
    const auto job = plan(
        small_job(),
        [&](double, const std::string& text) {
          if (text == at) reached = stop.request_stop();
        },
        stop.get_token());
    EXPECT_TRUE(reached);
    ASSERT_FALSE(job.ok()) << at;
    EXPECT_EQ(job.error().code, ErrorCode::kCancelled);
    EXPECT_EQ(jobs(), 0U);
  }
}

TEST_F(PlanServiceTest, APlanReservesNothingUntilAJobIsMadeOfIt) {
  add_panel("P-0001", 255);
  const auto plan = stored_plan(small_job());
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_EQ(to_json(*plan)["plan"], plan->plan.value);
  EXPECT_EQ(jobs(), 0U);
  const auto live = database_->call([](Repositories& r) { return r.ledger.live_allocations(PanelId{"P-0001"}); });
  EXPECT_TRUE(live->empty());
  const auto make = [&] {
    return database_->call([&](Repositories& r) { return r.jobs.create(plan->plan, "2026-02-01T00:00:00.000Z"); });
  };
  const auto job = make();
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(database_->call([&](Repositories& r) { return r.jobs.pieces(*job); })->size(), plan->pieces);
  EXPECT_EQ(make().error().code, ErrorCode::kConflict) << "its wood is held by now";
}

TEST_F(PlanServiceTest, AChangedPlanKeepsWhatIsNotNamedAndKnowsItsParent) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.options.alternatives = 2;
  request.max_panels = 1;
  const auto first = stored_plan(request);
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto before = pieces_of(first->plan);
  const auto second = changed({first->plan, "swapped", {{}, {}, {{"A1-1", "A2-2"}}, {}}, {}, 1});
  ASSERT_TRUE(second.ok()) << second.error().message;
  const auto after = pieces_of(second->plan);
  const auto centre = [](const db::PlannedPatch& piece) {
    const Box<PanelFrame> box = bounds(piece.panel_outline);
    return Point<PanelFrame>{(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2};
  };
  EXPECT_LT(distance(centre(after.at("A1-1")), centre(before.at("A2-2"))).count(), 0.01);
  EXPECT_LT(distance(centre(after.at("A2-2")), centre(before.at("A1-1"))).count(), 0.01);
  EXPECT_EQ(after.at("A1-2").panel_outline, before.at("A1-2").panel_outline);
  EXPECT_EQ(after.at("A2-1").panel_outline, before.at("A2-1").panel_outline);
  const auto record = database_->call([&](Repositories& r) { return r.plans.find(second->plan); });
  ASSERT_TRUE(record.ok());
  EXPECT_EQ(record->parent, first->plan);
  EXPECT_EQ(record->name, "swapped");
  EXPECT_EQ(record->who, "uid 1000");
  const auto options = nlohmann::json::parse(record->options_json);
  EXPECT_EQ(options["alternatives"], 2);
  EXPECT_EQ(options["max_panels"], 1);
  EXPECT_EQ(options["patch_mm"], 3);
  // Where a piece lay may be forbidden: it goes elsewhere.
  const Box<PanelFrame> old = bounds(after.at("A1-2").panel_outline);
  const auto third = changed({second->plan, "", {}, {{PanelId{"P-0001"}, old}}, 1});
  ASSERT_TRUE(third.ok()) << third.error().message;
  EXPECT_NE(pieces_of(third->plan).at("A1-2").panel_outline, after.at("A1-2").panel_outline);
  EXPECT_EQ(pieces_of(third->plan).at("A1-1").panel_outline, after.at("A1-1").panel_outline);
  EXPECT_EQ(changed({{99}, "", {}, {}, 1}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(changed({first->plan, "", {{}, {"B9-9"}, {}, {}}, {}, 1}).error().code, ErrorCode::kNotFound);
}

TEST_F(PlanServiceTest, TheSamePlanIsMadeAgainWithOtherPlacesForItsPieces) {
  add_panel("P-0001", 255);
  const auto first = stored_plan(small_job());
  ASSERT_TRUE(first.ok()) << first.error().message;
  PlanService::Change change{first->plan, "", {}, {}, 1};
  change.alternatives = 2;
  const auto second = changed(change);
  ASSERT_TRUE(second.ok()) << second.error().message;
  const auto before = pieces_of(first->plan);
  for (const auto& [mark, piece] : pieces_of(second->plan))
    EXPECT_EQ(piece.panel_outline, before.at(mark).panel_outline);
  const auto text = database_->call([&](Repositories& r) { return r.plans.plan_json(second->plan); });
  const auto read = planner::plan_from_json(*text);
  ASSERT_TRUE(read.ok()) << read.error().message;
  for (const auto& piece : read->pieces) EXPECT_EQ(piece.alternatives.size(), 2U) << piece.mark;
  const auto record = database_->call([&](Repositories& r) { return r.plans.find(second->plan); });
  EXPECT_EQ(nlohmann::json::parse(record->options_json)["alternatives"], 2);
}

TEST_F(PlanServiceTest, ADrawingsRegionsBecomeThePieces) {
  add_panel("P-0001", 255);
  JobRequest request = refined_job();
  request.options.refine = planner::Refine::kNone;
  const std::string picture = request.files.text();
  const std::string drawing =
      R"(<svg width="60mm" height="60mm" viewBox="0 0 60 60"><rect width="60" height="20"/>)"
      R"(<rect y="20" width="20" height="40"/><rect x="20" y="20" width="40" height="40"/></svg>)";
  const auto with = [&](const std::string& behind) {
    request.files = picture + behind;
    request.segmentation_bytes = behind.size();
  };
  with(drawing);
  request.options.layout = planner::LayoutKind::kSegmentation;
  const auto made = stored_plan(request);
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto pieces = pieces_of(made->plan);
  ASSERT_EQ(pieces.size(), 3U);
  const double side = request.size.count();
  double top = 0, area = 0;
  for (const auto& [mark, piece] : pieces) {
    const Box<ArtworkFrame> box = bounds(piece.artwork_outline);
    area += std::abs(signed_area(piece.artwork_outline));
    if (box.width().count() > 0.9 * side) top = box.height().count();
  }
  EXPECT_NEAR(top, side / 3, 0.05 * side) << "the strip along the upper edge";
  EXPECT_NEAR(area, side * side, 1e-3 * side * side);

  const auto kept = [&](db::PlanId plan) {
    const auto record = database_->call([&](Repositories& r) { return r.plans.find(plan); });
    return kept_drawing(record->options_json).value_or(KeptDrawing{});
  };
  const auto kept_bytes = library_.load_bytes(kept(made->plan).file);
  ASSERT_TRUE(kept_bytes.ok()) << kept_bytes.error().message;
  EXPECT_EQ(*kept_bytes, drawing);
  // What changes the plan has its layout, and no need of the drawing, which may be lost; what was asked for is known.
  library_.remove(kept(made->plan).file);
  const auto again = changed({made->plan, "", {{}, {pieces.begin()->first}, {}, {}}, {}, 1});
  ASSERT_TRUE(again.ok()) << again.error().message;
  const auto after = pieces_of(again->plan);
  ASSERT_EQ(after.size(), 3U);
  for (const auto& [mark, piece] : pieces) EXPECT_EQ(after.at(mark).artwork_outline, piece.artwork_outline) << mark;
  EXPECT_EQ(kept(again->plan).file, kept(made->plan).file);
  EXPECT_EQ(kept(again->plan).bytes, drawing.size());
  const auto third = changed({again->plan, "", {}, {}, 1});
  ASSERT_TRUE(third.ok()) << third.error().message;
  EXPECT_EQ(kept(third->plan).file, kept(made->plan).file) << "over any number of changes";

  with("<svg width='9mm' height='9mm'><path d='M 0 0 H 9 V 9' fill='none'/></svg>");
  const auto open = stored_plan(request);
  ASSERT_FALSE(open.ok());
  EXPECT_EQ(open.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(open.error().message, ::testing::HasSubstr("the drawing of test: the drawing has no closed region"));
}

TEST_F(PlanServiceTest, VerticesOfAGridAreWhereTheyArePinned) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.options.layout = planner::LayoutKind::kMorph;
  const double middle = request.size.count() / 2, x = middle + 0.6, y = middle - 0.4;
  request.pinned_vertices = fmt::format("1,1,{},{}", x, y);
  const auto made = stored_plan(request);
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto pieces = pieces_of(made->plan);
  ASSERT_EQ(pieces.size(), 4U);
  for (const auto& [mark, piece] : pieces) {
    double nearest = 1e9;
    for (const auto& corner : piece.artwork_outline)
      nearest = std::min(nearest, distance(corner, Point<ArtworkFrame>{Millimetres(x), Millimetres(y)}).count());
    EXPECT_LT(nearest, 2e-3) << mark;
  }
  request.pinned_vertices = "7,1,1,1";
  EXPECT_EQ(stored_plan(request).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(PlanServiceTest, AMosaicHeedsWhatIsPaintedAndDrawnAndLimitsOfWoods) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.options.layout = planner::LayoutKind::kMosaic;
  request.cell_sizes = "2x2:f000";
  const auto outlines = [&] {
    std::vector<Ring<ArtworkFrame>> out;
    const auto made = stored_plan(request);
    EXPECT_TRUE(made.ok()) << made.error().message;
    if (!made.ok()) return out;
    for (const auto& [mark, piece] : pieces_of(made->plan)) out.push_back(piece.artwork_outline);
    return out;
  };
  const auto without_lines = outlines();
  request.flow_lines = "0,2000 10000,8000";
  EXPECT_NE(outlines(), without_lines);
  const auto refusal = [&](const auto& change) {
    JobRequest other = request;
    change(other);
    const auto refused = stored_plan(other);
    EXPECT_FALSE(refused.ok());
    return refused.ok() ? "" : refused.error().message;
  };
  EXPECT_THAT(refusal([](JobRequest& it) { it.cell_sizes = "2x2:ffff"; }),
              ::testing::HasSubstr("are white everywhere"));
  EXPECT_THAT(refusal([](JobRequest& it) { it.flow_lines = "20000,20000 30000,30000"; }),
              ::testing::HasSubstr("no flow line of \"test\" runs over it"));
  // Drawn on a page of another shape than the picture's, which is square.
  EXPECT_THAT(refusal([](JobRequest& it) { it.flow_lines = "210x140:0,2000 10000,8000"; }),
              ::testing::HasSubstr("flow_lines: the drawing has a page of 210 x 140 mm, and the picture"));
  EXPECT_THAT(refusal([](JobRequest& it) { it.flow_lines = "", it.options.flow_lines_only = true; }),
              ::testing::HasSubstr("has none: draw some"));
  EXPECT_THAT(refusal([](JobRequest& it) { it.wood_limits = {{"elm", 0.5}}; }), ::testing::HasSubstr("elm"));
}

TEST_F(PlanServiceTest, WhatAPlanWasAskedForIsReadAgainAsItWas) {
  JobRequest request = small_job();
  request.options.optimize = planner::Optimize::kGlobal;
  request.options.exact = true;
  request.panels = {PanelId{"P-0001"}, PanelId{"P-0002"}};
  request.woods = {"black walnut", "oak"};
  request.wood_weights = {{"oak", 2}, {"ash", 0.5}};
  request.wood_limits = {{"oak", 0.5}};
  request.forbidden = {*planner::forbidden_wood("P-0001,1,2,3,4"), *planner::forbidden_wood("P-0002,5,6,7,8")};
  const auto again = job_request_again(request.name, request.files, options_json(request).dump());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(options_json(*again), options_json(request));
  EXPECT_EQ(again->files, request.files);
  EXPECT_EQ(job_request_again("x", "y", "no JSON").error().code, ErrorCode::kStorage);
}

}  // namespace
}  // namespace veneer::daemon
