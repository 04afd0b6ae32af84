// Plans that lease their wood, as the API has them.
#include <gmock/gmock.h>

#include "base/clock.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

class LeaseRoutes : public testing::RoutedCell {
 protected:
  void SetUp() override {
    const auto made = cell->database->call([](Repositories& r) -> Result<db::PlanId> {
      db::PanelRecord panel;
      panel.id = panel.root = PanelId{"P-0001"};
      panel.width = 200_mm, panel.height = 100_mm, panel.created_at = utc_timestamp();
      db::FiducialRecord hole;
      hole.kind = db::FiducialKind::kHole, hole.face = Face::kBack, hole.corners = {point<PanelFrame>(190, 90)};
      if (Status added = r.panels.add(panel, {}, {hole}); !added) return added.error();
      if (auto first = r.plans.add(plan(10), utc_timestamp()); !first) return first;
      return r.plans.add(plan(15), utc_timestamp());
    });
    ASSERT_TRUE(made.ok()) << made.error().message;
  }
  // One piece of 10 x 10 mm; the two plans want some of the same wood, and 2 mm of it around each piece.
  static db::NewPlan plan(double x) {
    db::NewPlan out;
    out.name = "portrait", out.who = "uid 1000", out.plan_json = "{}", out.options_json = R"({"web_mm":2})";
    db::PlannedPatch& piece = out.pieces.emplace_back();
    piece.mark = "A1-1";
    piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(10, 0), point<ArtworkFrame>(10, 10)};
    piece.panel = PanelId{"P-0001"};
    piece.panel_outline = {point<PanelFrame>(x, 10), point<PanelFrame>(x + 10, 10), point<PanelFrame>(x + 10, 20)};
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), 0.27_mm);
    out.planned_on = {{PanelId{"P-0001"}, 1}};
    return out;
  }
  json view(int id) { return body_of(ask("GET", "/api/v1/plans/" + std::to_string(id))); }
  std::string state() {
    const json rows = body_of(ask("GET", "/api/v1/panels/P-0001/ledger"))["allocations"];
    return rows.empty() ? "" : rows.back()["state"].get<std::string>();
  }
  std::vector<std::string> audited() {
    const auto entries = cell->database->call([](Repositories& r) { return r.audit.latest(100); });
    std::vector<std::string> out;
    for (const auto& entry : *entries) out.push_back(entry.what + " " + entry.detail);
    return out;
  }
};

TEST_F(LeaseRoutes, APlanLeasesItsWoodUntilAJobIsMadeOfIt) {
  const ApiReply leased = ask("POST", "/api/v1/plans/1/lease", {{"days", 14}});
  ASSERT_EQ(leased.status, 200) << leased.body;
  const json lease = body_of(leased)["lease"];
  EXPECT_EQ(lease["who"], "uid 1000");
  EXPECT_GT(lease["until"].get<std::string>(), utc_timestamp(std::chrono::hours(24 * 14 - 1)));
  EXPECT_LE(lease["until"].get<std::string>(), utc_timestamp(std::chrono::hours(24 * 14)));
  EXPECT_EQ(view(1)["lease"], lease);
  EXPECT_EQ(state(), "leased");

  const TaskView refused = ended(ask("POST", "/api/v1/jobs", {{"plan", 2}}));
  EXPECT_EQ(refused.state, TaskState::kFailed);
  EXPECT_EQ(ask("POST", "/api/v1/plans/2/lease").status, 409);
  EXPECT_EQ(ask("DELETE", "/api/v1/plans/1").status, 409);
  EXPECT_EQ(ask("POST", "/api/v1/panels/P-0001/retire", {{"reason", "split"}}).status, 409);

  const TaskView job = ended(ask("POST", "/api/v1/jobs", {{"plan", 1}}));
  EXPECT_EQ(job.state, TaskState::kDone) << to_text(job);
  EXPECT_EQ(view(1)["lease"], json());
  EXPECT_EQ(state(), "reserved");
}

TEST_F(LeaseRoutes, ALeaseIsRenewedAndGivenBack) {
  ASSERT_EQ(ask("POST", "/api/v1/plans/1/lease").status, 200);
  const json leased = body_of(ask("GET", "/api/v1/plans?leased=true"))["plans"];
  ASSERT_EQ(leased.size(), 1U) << "of two plans";
  EXPECT_EQ(leased[0]["id"], 1);
  EXPECT_EQ(leased[0]["lease"], view(1)["lease"]);
  const std::string a_week = view(1)["lease"]["until"];
  EXPECT_LE(a_week, utc_timestamp(std::chrono::hours(24 * 7)));
  const ApiReply renewed = ask("POST", "/api/v1/plans/1/lease", {{"days", 90}});
  EXPECT_EQ(renewed.status, 200) << renewed.body;
  EXPECT_GT(view(1)["lease"]["until"].get<std::string>(), a_week);
  const ApiReply released = ask("DELETE", "/api/v1/plans/1/lease");
  EXPECT_EQ(released.status, 200) << released.body;
  EXPECT_EQ(body_of(released)["lease"], json());
  EXPECT_TRUE(body_of(ask("GET", "/api/v1/plans?leased=true"))["plans"].empty());
  EXPECT_EQ(state(), "released");
  EXPECT_EQ(ask("DELETE", "/api/v1/plans/1/lease").status, 409);
  EXPECT_EQ(ask("DELETE", "/api/v1/plans/9/lease").status, 404);
  EXPECT_EQ(ask("POST", "/api/v1/plans/9/lease").status, 404);
  EXPECT_EQ(ask("POST", "/api/v1/plans/1/lease", {{"days", 91}}).status, 400);
  EXPECT_EQ(ask("POST", "/api/v1/plans/2/lease").status, 200);
  EXPECT_EQ(ask("DELETE", "/api/v1/plans/1").status, 200);
}

TEST_F(LeaseRoutes, ALeaseThatIsOverEndsByItself) {
  const auto leased = cell->database->call([](Repositories& r) {
    return r.leases.take({1}, "uid 1000", "2026-01-01T00:00:00.000Z", "2026-01-08T00:00:00.000Z");
  });
  ASSERT_TRUE(leased.ok()) << leased.error().message;
  EXPECT_EQ(view(1)["lease"], json()) << "nobody has ended it yet, but it is over";
  cell->leases->changed({});
  for (int turns = 0; state() == "leased" && turns < 100; ++turns) {
    reactor.restart();
    reactor.run_one_for(std::chrono::milliseconds(100));
  }
  EXPECT_EQ(state(), "released");
  EXPECT_THAT(audited(), ::testing::Contains("lease.end the lease of plan 1, expired"));
}

TEST_F(LeaseRoutes, WhoeverWantsTheWoodNeedNotWaitForThat) {
  const auto leased = cell->database->call([](Repositories& r) {
    return r.leases.take({1}, "uid 1000", "2026-01-01T00:00:00.000Z", "2026-01-08T00:00:00.000Z");
  });
  ASSERT_TRUE(leased.ok()) << leased.error().message;
  const TaskView job = ended(ask("POST", "/api/v1/jobs", {{"plan", 2}}));
  EXPECT_EQ(job.state, TaskState::kDone) << to_text(job);
}

// A mask has as many letters as somebody painted cells: of each plan it is told by itself.
TEST_F(LeaseRoutes, TheListOfPlansHoldsNoMask) {
  const auto made = cell->database->call([](Repositories& r) {
    db::NewPlan painted = plan(40);
    painted.options_json = R"({"large_edges":"4x2:f0","fine_edges":"4x2:0f","importance":"2x2:8f83","web_mm":2})";
    return r.plans.add(painted, utc_timestamp());
  });
  ASSERT_TRUE(made.ok()) << made.error().message;
  const json listed = body_of(ask("GET", "/api/v1/plans"))["plans"];
  ASSERT_EQ(listed.size(), 3U);
  EXPECT_EQ(listed[2]["options"], json({{"web_mm", 2}}));
  EXPECT_EQ(view(3)["options"]["importance"], "2x2:8f83");
  EXPECT_EQ(view(3)["options"]["large_edges"], "4x2:f0");
  EXPECT_EQ(view(3)["options"]["fine_edges"], "4x2:0f");
}

}  // namespace
}  // namespace veneer::daemon
