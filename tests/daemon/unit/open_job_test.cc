// What of a job is still to be cut, and whether this cell may cut it.
#include "daemon/unit/open_job.h"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>

#include "tests/support/stocked_database.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class OpenJobTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(directory_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
  }
  void stock() {
    // Two pieces on the first panel, one on the second.
    const Status stocked = tests::stock_two_panels(*database_, 2, 1);
    ASSERT_TRUE(stocked.ok()) << stocked.error().message;
  }
  Result<OpenJob> load(int job = 1) {
    return database_->call([job](Repositories& r) { return load_open_job(r, JobId{job}); });
  }
  std::vector<std::string> marks(int job = 1) {
    const auto open = load(job);
    std::vector<std::string> out;
    if (!open) ADD_FAILURE() << open.error().message;
    if (open)
      for (const auto& piece : open->pieces) out.push_back(piece.panel->value + " " + piece.mark);
    return out;
  }
  Error refused(int job = 1) {
    const auto open = load(job);
    EXPECT_FALSE(open.ok());
    return open ? Error{} : open.error();
  }
  void change(const std::function<Status(Repositories&)>& work) {
    const Status done = database_->call(work);
    ASSERT_TRUE(done.ok()) << done.error().message;
  }
  void cut_on(const char* panel, const std::vector<int>& pieces) {
    change([&](Repositories& r) -> Status {
      const auto run = r.jobs.start_run(JobId{1}, PanelId{panel}, {}, 0.04_mm, tests::kThen);
      if (!run) return run.error();
      for (const int piece : pieces) {
        if (Status begun = r.jobs.mark_cutting(PieceId{piece}, tests::kThen); !begun) return begun;
        if (Status booked = r.jobs.book_piece(PieceId{piece}, tests::kThen); !booked) return booked;
      }
      return r.jobs.finish_run(*run, true, tests::kThen);
    });
  }

  boost::asio::io_context reactor_;
  testing::TempDirectory directory_;
  std::unique_ptr<DatabaseThread> database_;
};

TEST_F(OpenJobTest, GivesWhatIsStillToBeCutAndNothingElse) {
  stock();
  EXPECT_EQ(load()->name, "test");
  EXPECT_THAT(marks(), ElementsAre("P-0001 A1-1", "P-0001 A1-2", "P-0002 A1-3"));
  cut_on("P-0001", {1});
  EXPECT_THAT(marks(), ElementsAre("P-0001 A1-2", "P-0002 A1-3"));
}

TEST_F(OpenJobTest, GoesPanelByPanelAndOnEachAsThePlanDoes) {
  stock();
  change([](Repositories& r) -> Status {
    db::NewPlan job;
    job.name = "mixed", job.plan_json = job.options_json = "{}";
    for (const auto& [mark, panel] :
         {std::pair("B1", "P-0002"), {"B2", "P-0001"}, {"B3", "P-0002"}, {"B4", "P-0001"}}) {
      db::PlannedPatch& piece = job.pieces.emplace_back();
      const double x = 20.0 * static_cast<double>(job.pieces.size());
      piece.mark = mark, piece.panel = PanelId{panel};
      piece.artwork_outline = {point<ArtworkFrame>(x, 0), point<ArtworkFrame>(x + 10, 0),
                               point<ArtworkFrame>(x + 10, 10)};
      piece.panel_outline = {point<PanelFrame>(x, 50), point<PanelFrame>(x + 10, 50), point<PanelFrame>(x + 10, 60)};
      piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), 0.27_mm);
    }
    job.planned_on = {{PanelId{"P-0001"}, 1}, {PanelId{"P-0002"}, 1}};
    const auto made = r.jobs.create(job, tests::kThen);
    return made ? Ok() : Status(made.error());
  });
  EXPECT_THAT(marks(2), ElementsAre("P-0001 B2", "P-0001 B4", "P-0002 B1", "P-0002 B3"));
}

TEST_F(OpenJobTest, SaysWhatIsMissing) {
  EXPECT_THAT(refused().message, HasSubstr("the bed camera has no valid certificate"));
  stock();
  EXPECT_EQ(refused(7).code, ErrorCode::kNotFound);
  cut_on("P-0001", {1, 2});
  cut_on("P-0002", {3});
  EXPECT_EQ(refused().code, ErrorCode::kConflict);
  EXPECT_EQ(refused().message, "job 1 has no piece left to cut");
}

TEST_F(OpenJobTest, AsksForASuspectPieceAndForWoodThatIsLost) {
  stock();
  cut_on("P-0001", {1, 2});
  cut_on("P-0002", {3});
  change([](Repositories& r) { return r.jobs.make_suspect({{PieceId{2}}}, tests::kThen); });
  EXPECT_THAT(refused().message, HasSubstr("but 1 is suspect: look at it"));
  change([](Repositories& r) {
    return r.jobs.settle(PieceId{2}, db::AllocationState::kScrap, tests::kThen, "user anna");
  });
  EXPECT_THAT(refused().message, HasSubstr("1 is missing: find other wood with veneerctl job redo 1"));
}

TEST_F(OpenJobTest, WoodThatAScanFoundGoneIsDecidedOnFirst) {
  stock();
  change([](Repositories& r) {
    db::DifferenceRecord hole;
    hole.gone = true, hole.area = SquareMillimetres(9);
    hole.shape =
        Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(5, 1), point<PanelFrame>(8, 1), point<PanelFrame>(8, 4)});
    hole.place = point<PanelFrame>(7, 2);
    return r.differences.found(PanelId{"P-0001"}, {hole}, tests::kThen);
  });
  EXPECT_EQ(refused().code, ErrorCode::kRefused);
  EXPECT_THAT(refused().message, HasSubstr("where piece A1-1 of job 1 is to be cut from panel P-0001"));
}

TEST(CutsStock, NotByASimulatedEyeNorWithoutACornerNorIntoAFile) {
  RunnerOptions options;
  LaserLimits limits;
  limits.finds_home = limits.burns = true;
  EXPECT_TRUE(check_cuts_stock(options, limits).ok());
  limits.burns = false;
  EXPECT_THAT(check_cuts_stock(options, limits).error().message, HasSubstr("a file that records its bytes"));
  limits.finds_home = false;
  EXPECT_THAT(check_cuts_stock(options, limits).error().message, HasSubstr("$22=1"));
  options.stock_refusal = "the camera is simulated";
  EXPECT_EQ(check_cuts_stock(options, limits).error().message, "the camera is simulated");
  EXPECT_EQ(check_cuts_stock(options, limits).error().code, ErrorCode::kRefused);
}

}  // namespace
}  // namespace veneer::daemon
