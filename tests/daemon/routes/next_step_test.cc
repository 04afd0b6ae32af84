// What is to be done next, as the status tells it.
#include <gmock/gmock.h>

#include "base/clock.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::StartsWith;

class NextStepOfTheCell : public testing::RoutedCell {
 protected:
  json next() {
    until_counted();
    return body_of(ask("GET", "/api/v1/status"))["next_step"];
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
    return r.plans.add(plan, utc_timestamp());
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

}  // namespace
}  // namespace veneer::daemon
