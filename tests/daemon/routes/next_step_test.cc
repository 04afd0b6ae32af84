// What is to be done next, as the status tells it.
#include <gmock/gmock.h>

#include "base/clock.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class NextStepOfTheCell : public testing::RoutedCell {
 protected:
  json next() {
    until_counted();
    return body_of(ask("GET", "/api/v1/status"))["next_step"];
  }
  // On a panel that enters stock with it, and that needs no scan.
  static Result<db::NewPlan> plan_of_one_piece(Repositories& r) {
    db::PanelRecord panel;
    panel.id = panel.root = PanelId{"P-0001"};
    panel.width = 200_mm, panel.height = 100_mm, panel.created_at = utc_timestamp();
    db::FiducialRecord hole;
    hole.kind = db::FiducialKind::kHole, hole.face = Face::kBack, hole.corners = {point<PanelFrame>(190, 90)};
    if (Status added = r.panels.add(panel, {}, {hole}); !added) return added.error();
    db::NewPlan plan;
    plan.name = "portrait", plan.who = "uid 1000", plan.plan_json = plan.options_json = "{}";
    db::PlannedPatch& piece = plan.pieces.emplace_back();
    piece.mark = "A1-1";
    piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(10, 0), point<ArtworkFrame>(10, 10)};
    piece.panel = panel.id;
    piece.panel_outline = {point<PanelFrame>(10, 10), point<PanelFrame>(20, 10), point<PanelFrame>(20, 20)};
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), 0.27_mm);
    plan.planned_on = {{panel.id, 1}};
    return plan;
  }
  void certify() {
    for (const auto kind : {db::CertificateKind::kScanner, db::CertificateKind::kCamera, db::CertificateKind::kAxes,
                            db::CertificateKind::kKerf})
      cell->counts.calibration->standing[kind] = {CertificateState::kValid, CertificateId{1},
                                                  utc_timestamp(std::chrono::hours(24))};
  }
};

TEST_F(NextStepOfTheCell, ANewCellIsCalibratedFirst) {
  EXPECT_EQ(next(), json({{"step", "calibrate_scanner"},
                          {"sentence",
                           "The scanner is not calibrated yet: lay the printed grid on the glass, print "
                           "down, and calibrate the scanner."},
                          {"command", "veneerctl calibrate scanner"},
                          {"job", nullptr}}));
}

TEST_F(NextStepOfTheCell, ThenItFollowsStockPlansAndJobs) {
  static_cast<void>(next());
  certify();
  EXPECT_EQ(body_of(ask("GET", "/api/v1/status"))["next_step"]["step"], "scan");
  const auto made = cell->database->call([](Repositories& r) -> Result<db::PlanId> {
    const auto plan = plan_of_one_piece(r);
    if (!plan) return plan.error();
    return r.plans.add(*plan, utc_timestamp());
  });
  ASSERT_TRUE(made.ok()) << made.error().message;
  cell->refresh_counts();
  static_cast<void>(next());
  certify();
  EXPECT_EQ(body_of(ask("GET", "/api/v1/status"))["next_step"]["command"], "veneerctl job new --plan 1");

  // Nobody asks for the counts: a new job makes the cell count anew.
  EXPECT_EQ(ended(ask("POST", "/api/v1/jobs", {{"plan", 1}})).state, TaskState::kDone);
  static_cast<void>(next());
  static_cast<void>(next());
  certify();
  const json step = body_of(ask("GET", "/api/v1/status"))["next_step"];
  EXPECT_EQ(step["step"], "reset");
  EXPECT_EQ(step["job"], 1) << "what the console's Start begins";
  EXPECT_THAT(step["sentence"].get<std::string>(), StartsWith("Job 1 “portrait” has 1 piece to cut: "));
}

// Since whenever, and whoever asks: nothing but the database remembers it after a restart.
TEST_F(NextStepOfTheCell, SuspectAndThenMissingPiecesOfAJobOfYesterdayAreNamed) {
  const auto aborted = cell->database->call([](Repositories& r) -> Result<JobId> {
    const auto plan = plan_of_one_piece(r);
    if (!plan) return plan.error();
    auto job = r.jobs.create(*plan, utc_timestamp());
    if (!job) return job;
    const auto run = r.jobs.start_run(*job, PanelId{"P-0001"}, {}, 0.04_mm, utc_timestamp());
    if (!run) return run.error();
    const std::vector<PieceId> suspects = {{1}};
    if (Status ended = r.jobs.abort_run(*run, suspects, "killed", utc_timestamp()); !ended) return ended.error();
    return job;
  });
  ASSERT_TRUE(aborted.ok()) << aborted.error().message;
  const auto told = [this] {
    cell->refresh_counts();
    static_cast<void>(next());
    certify();
    return body_of(ask("GET", "/api/v1/status"))["next_step"];
  };
  EXPECT_EQ(told()["command"], "veneerctl job settle 1");
  const auto as_seen = [this](const json& body) { return ask("POST", "/api/v1/jobs/1/settle-as-seen", body); };
  const json scrap = {{"there", "scrap"}, {"pieces", {"A1-1"}}};
  EXPECT_EQ(as_seen(scrap).status, 409) << "no scan saw it";
  ASSERT_TRUE(cell->database->call([](Repositories& r) -> Status {
    const std::pair seen(r.jobs.find_piece(PieceId{1})->allocation,
                         db::Sighting{db::Seen::kStillThere, 0.01, 1, utc_timestamp()});
    return r.jobs.note_sightings({&seen, 1});
  }));
  const ApiReply begun = as_seen(json::object());
  EXPECT_EQ(begun.status, 409) << "whether a kerf was begun it did not see";
  EXPECT_THAT(
      body_of(begun)["error"]["message"].get<std::string>(),
      HasSubstr("the scan saw the wood of A1-1 still in the panel, and no scan sees a cut that was only begun: look "
                "at it, then say veneerctl job settle 1 --as-seen --there scrap --pieces A1-1"));
  EXPECT_EQ(as_seen({{"there", "scrap"}}).status, 400) << "which did he look at?";
  EXPECT_EQ(as_seen({{"there", "scrap"}, {"pieces", json::array()}}).status, 400);
  EXPECT_EQ(as_seen({{"there", "scrap"}, {"pieces", {"A1-1", "A1-2"}}}).status, 409) << "not all of them were seen so";
  const json none = json::array();
  EXPECT_EQ(
      body_of(as_seen(scrap)),
      json(
          {{"schema_version", 1}, {"job", 1}, {"cut", none}, {"scrap", {"A1-1"}}, {"released", none}, {"left", none}}));
  const auto noted = cell->database->call([](Repositories& r) {
    db::AuditFilter of;
    of.what = "job.settle-as-seen";
    return r.audit.read(of, 10);
  });
  ASSERT_EQ(noted->size(), 1U);
  EXPECT_EQ(noted->front().who, "uid 1000");
  EXPECT_EQ(told()["command"], "veneerctl job redo 1");
}

}  // namespace
}  // namespace veneer::daemon
