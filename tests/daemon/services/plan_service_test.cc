// The plan service on a small stock: what it keeps and drops beside the plan.
#include "daemon/services/plan_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "daemon/routes/cell_json.h"
#include "daemon/services/plan_web.h"
#include "daemon/store/calibration.h"
#include "planner/cutting/lead_choice.h"
#include "planner/files/plan_files.h"
#include "planner/plan_options.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {
namespace {

class PlanServiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(folder_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kKerf;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    calib::KerfMeasurement kerf;
    kerf.mean = Millimetres(0.1);
    certificate.payload = to_payload(kerf).dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  // A panel of 17 x 17 mm; all of its wood is free, or none.
  void add_panel(const std::string& id, int free) { add_panel(id, free, planner::test::wood_picture(200, 200, 7)); }
  void add_panel(const std::string& id, int free, const cv::Mat& picture, bool back_scanned = true) {
    const auto map = library_.store_picture(picture, "panels/" + id, "map");
    const auto mask =
        library_.store_picture(cv::Mat(picture.size(), CV_8UC1, cv::Scalar(free)), "panels/" + id, "mask");
    ASSERT_TRUE(map.ok() && mask.ok());
    db::PanelRecord panel;
    panel.id = PanelId{id};
    panel.name = id;
    panel.width = ScanResolution::from_dpi(300).to_mm(Pixels(picture.cols));
    panel.height = ScanResolution::from_dpi(300).to_mm(Pixels(picture.rows));
    panel.map_file = map->file, panel.mask_file = mask->file, panel.map_hash = map->sha256;
    panel.created_at = "2026-01-01T00:00:00.000Z";
    db::FiducialRecord tag;  // beside all wood
    tag.face = back_scanned ? Face::kBack : Face::kShow;
    tag.tag_id = 200 + tags_++;
    tag.corners = {{-30_mm, 0_mm}, {-22_mm, 0_mm}, {-22_mm, 8_mm}, {-30_mm, 8_mm}};
    const Status added = database_->call([&](Repositories& r) { return r.panels.add(panel, {}, {tag}); });
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  // A strip of the panel, over all its height, is of this wood.
  void add_zone(const std::string& panel, Millimetres left, Millimetres right, const std::string& material) {
    const Ring<PanelFrame> outline{{left, 0_mm}, {right, 0_mm}, {right, 30_mm}, {left, 30_mm}};
    zones_[panel].push_back({static_cast<int>(zones_[panel].size()) + 1, outline, material});
  }
  void store_zones() {
    ASSERT_TRUE(database_->call([&](Repositories& r) -> Status {
      for (const auto& [panel, zones] : zones_) {
        if (Status added = r.materials.add_zones(PanelId{panel}, zones); !added) return added;
        for (const auto& zone : zones)
          if (Status named = r.materials.set_material(PanelId{panel}, zone.number, zone.material); !named) return named;
      }
      return Ok();
    }));
  }
  // Half of it dark, half of it pale, and to be rebuilt by brightness alone.
  static JobRequest two_tone_job() {
    JobRequest request = small_job();
    cv::Mat picture(20, 20, CV_8UC3, cv::Scalar::all(170));
    picture(cv::Rect(0, 0, 10, 20)).setTo(cv::Scalar::all(80));
    request.picture = png(picture);
    request.options.w_intensity = 1, request.options.w_edge = 0, request.options.w_hist = 1;
    return request;
  }
  std::filesystem::path leave_index(const std::string& panel) {
    const std::filesystem::path file = library_.index_dir() / (panel + "-0-3.index");
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << "of an earlier plan";
    return file;
  }
  // A picture of 6 x 6 mm in four patches.
  static JobRequest small_job() {
    JobRequest request;
    request.name = "test";
    request.picture = png(planner::test::blob_artwork("A", 20, 20, 6_mm, 3).picture);
    request.size = Millimetres(6);
    request.options.patch = Millimetres(3), request.options.rotations = 2, request.options.threads = 1;
    return request;
  }
  // With curved borders.
  static JobRequest refined_job() {
    JobRequest request = small_job();
    request.size = Millimetres(12);
    request.options.patch = Millimetres(6), request.options.dpi = 100;
    request.options.refine = planner::Refine::kDp;
    return request;
  }
  static std::string png(const cv::Mat& picture) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", picture, bytes);
    return {bytes.begin(), bytes.end()};
  }
  Result<JobOutcome> plan(
      const JobRequest& request, const TaskProgress& progress = [](double, const std::string&) {},
      const std::stop_token& stop = {}) {
    return service().make_job(request, progress, stop);
  }
  PlanService service() { return {*database_, library_, workers_, config_, make_null_logger()}; }
  Result<JobOutcome> stored_plan(const JobRequest& request) {
    return service().make_plan(request, "uid 1000", [](double, const std::string&) {}, {});
  }
  Result<JobOutcome> changed(const PlanService::Change& change) {
    return service().change_plan(change, "uid 1000", [](double, const std::string&) {}, {});
  }
  std::map<std::string, db::PlannedPatch> pieces_of(db::PlanId plan) {
    std::map<std::string, db::PlannedPatch> out;
    const auto pieces = database_->call([&](Repositories& r) { return r.plans.patches(plan); });
    for (const auto& piece : *pieces) out[piece.mark] = piece;
    return out;
  }
  std::size_t jobs() {
    return database_->call([](Repositories& r) { return r.jobs.list(); })->size();
  }

  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_;
  PanelLibrary library_{folder_.path()};
  testing::WorkHere workers_;
  Config config_;
  int tags_ = 0;
  std::map<std::string, std::vector<db::ZoneRecord>> zones_;
};

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

TEST_F(PlanServiceTest, ASketchStoresNothingAndSeesWhatIsBookedSince) {
  add_panel("P-0001", 255);
  const auto sketched = [&] {
    auto reader = database_->open_reader();
    return service().sketch(small_job(), (*reader)->repositories(), {});
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
  large.size = Millimetres(12);
  ASSERT_TRUE(plan(large).ok());
  const auto after = sketched();
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_NE(after->preview, first->preview) << "other wood";
}

// It was planned and reserved, and ended at the bed, where nobody knew the panel.
TEST_F(PlanServiceTest, OnlyWoodThatTheCameraFindsIsPlanned) {
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
TEST_F(PlanServiceTest, APanelThatWasSandedAfterItsScanIsNotPlanned) {
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

TEST_F(PlanServiceTest, ARetiredPanelIsNotPlanned) {
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

// One of a finished picture's pieces is lost; the panel was scanned since, and is full of holes.
TEST_F(PlanServiceTest, MakesALostPieceAgainFromWhatIsLeft) {
  add_panel("P-0001", 255);
  const auto made = plan(small_job());
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto pieces = [&] { return *database_->call([&](Repositories& r) { return r.jobs.pieces(made->job); }); };
  const auto before = pieces();
  const auto redo = [&](const std::vector<std::string>& marks) {
    return service().redo({made->job, marks, 1}, "uid 1000", [](double, const std::string&) {}, {});
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

  const auto done = redo({before[1].mark});
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
  EXPECT_EQ(redo({before[2].mark}).error().code, ErrorCode::kRefused) << "no panel in stock";
  add_panel("P-0002", 255);
  const auto elsewhere = redo({before[2].mark, before[1].mark});
  ASSERT_TRUE(elsewhere.ok()) << elsewhere.error().message;
  EXPECT_EQ(elsewhere->redone.size(), 2U);
  for (const std::size_t i : {1U, 2U}) EXPECT_EQ(pieces()[i].panel, PanelId{"P-0002"});
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

TEST_F(PlanServiceTest, TooLittleWoodIsToldByItsTonesAndWithThePatchThatWouldFit) {
  add_panel("P-0001", 255);
  JobRequest request = small_job();
  request.size = Millimetres(20), request.options.patch = Millimetres(10);
  const auto job = plan(request);
  ASSERT_FALSE(job.ok());
  EXPECT_EQ(job.error().code, ErrorCode::kRefused);
  EXPECT_THAT(
      job.error().message,
      ::testing::MatchesRegex("nothing is reserved: no free wood was left for 3 of 4 patches "
                              "\\(([0-9]+ mm2 (rather )?(dark|pale)(, )?)+\\); .* patches of [0-9.]+ mm would "
                              "still fit, .*: make the picture about 50 % smaller, add a panel or choose smaller "
                              "patches"));
  EXPECT_EQ(jobs(), 0U);
}

TEST_F(PlanServiceTest, APlainPictureIsWarnedOf) {
  add_panel("P-0001", 255);
  const auto detailed = plan(small_job());
  ASSERT_TRUE(detailed.ok()) << detailed.error().message;
  EXPECT_THAT(to_json(*detailed)["warnings"], ::testing::IsEmpty());
  JobRequest request = small_job();
  request.picture = png(cv::Mat(20, 20, CV_8UC3, cv::Scalar::all(120)));
  const auto plain = plan(request);
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  EXPECT_THAT(to_json(*plain)["warnings"], ::testing::ElementsAre("\"test\" is one plain tone, so there is nothing in "
                                                                  "it to rebuild: is it the right picture?"));
}

TEST_F(PlanServiceTest, APlanWithRefinedBordersKeepsAWebOfWoodAroundEachPiece) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto job = plan(refined_job());
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_GT(to_json(*job)["refined"]["cost_before"], to_json(*job)["refined"]["cost"]);
  const auto live = database_->call([](Repositories& r) { return r.ledger.live_allocations(PanelId{"P-0001"}); });
  ASSERT_EQ(live->size(), 4U);
  bool curved = false;
  for (const auto& one : *live) {
    curved = curved || one.outline.size() > 8;
    const Region<PanelFrame> webbed = offset(one.area, planner::kPieceWeb - Millimetres(0.01), Corners::kRound);
    for (const auto& other : *live) EXPECT_TRUE(one.id == other.id || !overlaps(webbed, other.area));
  }
  EXPECT_TRUE(curved);
  // Straight ones may touch.
  const auto straight = stored_plan(small_job());
  ASSERT_TRUE(straight.ok()) << straight.error().message;
  EXPECT_TRUE(to_json(*straight)["refined"].is_null());
  const auto kept = database_->call([&](Repositories& r) { return r.plans.find(straight->plan); });
  EXPECT_EQ(nlohmann::json::parse(kept->options_json)["web_mm"], 0);
}

// A mosaic's borders are curved without being refined.
TEST_F(PlanServiceTest, AMosaicKeepsAWebOfWoodAroundEachPiece) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  JobRequest request = refined_job();
  request.options.refine = planner::Refine::kNone;
  request.options.layout = planner::LayoutKind::kMosaic;
  const auto stored = stored_plan(request);
  ASSERT_TRUE(stored.ok()) << stored.error().message;
  const auto kept = database_->call([&](Repositories& r) { return r.plans.find(stored->plan); });
  EXPECT_EQ(nlohmann::json::parse(kept->options_json)["web_mm"], planner::kPieceWeb.count());
  const auto pieces = database_->call([&](Repositories& r) { return r.plans.patches(stored->plan); });
  ASSERT_GT(pieces->size(), 1U);
  for (const auto& piece : *pieces) {
    ASSERT_TRUE(piece.panel);
    const Region<PanelFrame> webbed = offset(piece.allocation, planner::kPieceWeb - Millimetres(0.01), Corners::kRound);
    for (const auto& other : *pieces)
      EXPECT_TRUE(other.mark == piece.mark || !overlaps(webbed, other.allocation)) << piece.mark << " " << other.mark;
  }
}

TEST_F(PlanServiceTest, APlanIsNoJobWhenOtherWoodCameNearerThanItsWeb) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto stored = stored_plan(refined_job());
  ASSERT_TRUE(stored.ok()) << stored.error().message;
  const auto pieces = database_->call([&](Repositories& r) { return r.plans.patches(stored->plan); });
  const auto kept = database_->call([&](Repositories& r) { return r.plans.find(stored->plan); });
  const auto keeps = [&] {
    return database_->call([&](Repositories& r) { return keeps_web(r, kept->options_json, *pieces); });
  };
  EXPECT_TRUE(keeps().ok());
  Millimetres right{0};
  for (const auto& piece : *pieces)
    for (const auto& ring : piece.allocation.rings())
      for (const auto& p : ring) right = std::max(right, p.x);
  const auto write_off = [&](Millimetres from) {
    const Ring<PanelFrame> strip{{from, 0_mm}, {from + 1_mm, 0_mm}, {from + 1_mm, 34_mm}, {from, 34_mm}};
    return database_->call([&](Repositories& r) {
      return r.ledger.write_off(PanelId{"P-0001"}, Region<PanelFrame>(strip), "test", "2026-01-01T00:00:00.000Z");
    });
  };
  ASSERT_TRUE(write_off(right + 1.4_mm).ok());
  EXPECT_TRUE(keeps().ok());
  ASSERT_TRUE(write_off(right + 0.1_mm).ok());
  ASSERT_FALSE(keeps().ok());
  EXPECT_EQ(keeps().error().code, ErrorCode::kConflict);
  EXPECT_THAT(keeps().error().message, ::testing::HasSubstr("less than 0.2 mm of wood"));
}

TEST_F(PlanServiceTest, WoodThatAPlanLeasesIsForItsOwnChangesAlone) {
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

TEST_F(PlanServiceTest, ARefinedPlanIsChangedWithItsWeb) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto stored = stored_plan(refined_job());
  ASSERT_TRUE(stored.ok()) << stored.error().message;
  PlanService::Change change;
  change.plan = stored->plan;
  change.edits.replanned = {"A1-1"};
  change.threads = 1;
  const auto after = changed(change);
  ASSERT_TRUE(after.ok()) << after.error().message;
  const auto before = pieces_of(stored->plan), now = pieces_of(after->plan);
  for (const auto& [mark, piece] : now) {
    EXPECT_EQ(piece.artwork_outline, before.at(mark).artwork_outline) << mark;
    const Region<PanelFrame> webbed = offset(piece.allocation, planner::kPieceWeb - Millimetres(0.01), Corners::kRound);
    for (const auto& [other, its] : now) EXPECT_TRUE(mark == other || !overlaps(webbed, its.allocation));
  }
}

TEST_F(PlanServiceTest, NoMorePanelsThanAllowedAreThoseWithTheMostFreeWood) {
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

TEST_F(PlanServiceTest, RemnantsComeBeforeFreshPanelsUnlessTheyHaveTooLittleWood) {
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
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0002"})) << "of remnants the fullest";
  request.remnants_first = false;
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0001"}));
  request.remnants_first = true;
  request.panels = {PanelId{"P-0001"}, PanelId{"P-0003"}};
  EXPECT_THAT(panels_of(), ::testing::ElementsAre(PanelId{"P-0001"})) << "the strip that is left is too little wood";
}

TEST_F(PlanServiceTest, OnlyTheWoodThatIsAskedForIsUsedZoneByZone) {
  cv::Mat wood(240, 240, CV_8UC3, cv::Scalar::all(200));
  wood(cv::Rect(0, 0, 120, 240)).setTo(cv::Scalar::all(50));
  add_panel("P-0001", 255, wood);
  add_zone("P-0001", 0_mm, Millimetres(10.2), "walnut");
  add_zone("P-0001", Millimetres(10.1), Millimetres(20.4), "maple");  // outlines are hulls: they may reach into others
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

TEST_F(PlanServiceTest, ForbiddenWoodStaysWhole) {
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

TEST_F(PlanServiceTest, AWoodThatIsGivenNoWeightLeavesNoTones) {
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

// Half of the panel is dark, half of it pale, and so is the picture.
TEST_F(PlanServiceTest, WoodThatAnEarlierJobHasBookedGivesALaterOneNeitherTonesNorPieces) {
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
        .make_job(small_job(), [](double, const std::string&) {}, {});
  });
  EXPECT_TRUE(announced.asked_within(std::chrono::seconds(10))) << "while a write takes its time";
  written.set_value();
  const auto job = planning.get();
  EXPECT_TRUE(job.ok()) << job.error().message;
}

// make_plan gives the best so far of a global choice that is stopped; whoever cancels a job wants none.
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

TEST_F(PlanServiceTest, WhatAPlanWasAskedForIsReadAgainAsItWas) {
  JobRequest request = small_job();
  request.options.optimize = planner::Optimize::kGlobal;
  request.options.exact = true;
  request.panels = {PanelId{"P-0001"}, PanelId{"P-0002"}};
  request.woods = {"black walnut", "oak"};
  request.wood_weights = {{"oak", 2}, {"ash", 0.5}};
  request.forbidden = {*planner::forbidden_wood("P-0001,1,2,3,4"), *planner::forbidden_wood("P-0002,5,6,7,8")};
  const auto again = job_request_again(request.name, request.picture, options_json(request).dump());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(options_json(*again), options_json(request));
  EXPECT_EQ(again->picture, request.picture);
  EXPECT_EQ(job_request_again("x", "y", "no JSON").error().code, ErrorCode::kStorage);
}

}  // namespace
}  // namespace veneer::daemon
