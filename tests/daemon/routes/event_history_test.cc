// What happened, in one list by time: of a job, a panel or a piece, page by page, and with who did it.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tests/daemon/routes/panel_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsSupersetOf;
using ::testing::Not;
using testing::panel_square;

class EventHistory : public PanelCell {
 protected:
  EventHistory() {
    const db::NewPlan plan = squares(6, {5, 15}, 5);
    change([&](Repositories& r) -> Status {
      const auto job = r.jobs.create(plan, kThen);
      return job ? Ok() : Status(job.error());
    });
  }
  // "job made by nobody"
  std::vector<std::string> happened(const std::string& query) {
    std::vector<std::string> out;
    const json page = get("/history/events?" + query);
    for (const json& event : page["events"])
      out.push_back(fmt::format("{} {} by {}", event["kind"].get<std::string>(), event["what"].get<std::string>(),
                                event["who"].is_null() ? "nobody" : event["who"].get<std::string>()));
    return out;
  }
};

TEST_F(EventHistory, ThatAJobWasCancelledAndArchivedStandsThereWithWhoDidIt) {
  ASSERT_EQ(post("/jobs/1/cancel").status, 200);
  ASSERT_EQ(post("/jobs/1/archive").status, 200);
  ASSERT_EQ(post("/jobs/1/unarchive").status, 200);
  ASSERT_EQ(post("/jobs/archive-done").status, 200);
  EXPECT_THAT(happened("job=1&until=2026-05-01T08:00"),
              ElementsAre("job made by local:1000", "wood reserved by nobody", "wood reserved by nobody"));
  EXPECT_THAT(happened("job=1&since=2026-05-01T08:00"),
              IsSupersetOf({"job cancelled by uid 1000", "wood released by nobody", "job archived by uid 1000",
                            "job in sight again by uid 1000"}));
  EXPECT_THAT(happened("job=1&kind=job&until=2026-05-01T08:00"), ElementsAre("job made by local:1000"));
  EXPECT_THAT(happened("job=2"), ElementsAre());
}

TEST_F(EventHistory, WhoMadeAJobOfAPlanStandsThere) {
  db::NewPlan plan = squares(6, {5, 15}, 12.5);
  plan.who = "user anna";
  db::FiducialRecord hole;
  hole.kind = db::FiducialKind::kHole, hole.face = Face::kBack, hole.corners = {point<PanelFrame>(28, 18)};
  change([&](Repositories& r) -> Status {
    if (Status known = r.panels.add_scans({"P-0002"}, {}, {hole}); !known) return known;
    const auto stored = r.plans.add(plan, kThen);
    return stored ? Ok() : Status(stored.error());
  });
  const TaskView made = ended(post("/jobs", {{"plan", 2}}));
  EXPECT_EQ(made.state, TaskState::kDone) << made.error.value_or(Error{}).message;
  EXPECT_THAT(happened("job=2&kind=job"), ElementsAre("job made by uid 1000"));
}

TEST_F(EventHistory, ThatAPanelWasRetiredStandsThereWithWhoDidIt) {
  ASSERT_EQ(post("/panels/P-0001/retire", {{"reason", "sold"}}).status, 200);
  ASSERT_EQ(post("/panels/P-0001/restore").status, 200);
  EXPECT_THAT(happened("panel=P-0001"),
              IsSupersetOf({"panel entered by nobody", "panel retired by uid 1000", "panel restored by uid 1000"}));
  EXPECT_THAT(happened("panel=P-0002"), Not(Contains("panel retired by uid 1000")));
  EXPECT_THAT(happened("piece=2"), ElementsAre("wood reserved by nobody"));
}

// Many have the same time.
TEST_F(EventHistory, PagesOfAnyLengthTogetherAreTheWholeList) {
  const json whole = get("/history/events?limit=1000&until=2026-05-01T08:00")["events"];
  ASSERT_GT(whole.size(), 7U);
  EXPECT_TRUE(std::ranges::is_sorted(whole, {}, [](const json& event) { return event["at"].get<std::string>(); }));
  for (int limit = 1; limit <= 9; ++limit) {
    json all = json::array();
    std::string cursor;
    do {
      const json page = get(fmt::format("/history/events?until=2026-05-01T08:00&limit={}{}", limit, cursor));
      ASSERT_TRUE(page["events"].is_array()) << page;
      for (const json& event : page["events"]) all.push_back(event);
      cursor = page["next"].is_null() ? "" : "&cursor=" + page["next"].get<std::string>();
    } while (!cursor.empty() && all.size() <= whole.size());
    EXPECT_EQ(all, whole) << limit;
  }
}

// As the status and the alarms do not tell them either.
TEST_F(EventHistory, NamesNoPortsAndPathsToViewers) {
  change([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(
        JobId{1}, PanelId{"P-0002"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm, kThen);
    if (!run) return run.error();
    const std::array suspects = {PieceId{1}};
    const std::string why = config.laser.port + " does not answer: /dev/ttyUSB7 is gone";
    const std::string asked =
        R"(POST /api/v1/laser/connect?port=/dev/ttyUSB7 {"port":"/dev/ttyUSB7"}, which does not answer)";
    if (Status noted = r.audit.append({0, kThen, "uid 1000", "api.connectLaser", asked}); !noted) return noted;
    if (Status noted = r.audit.append({0, kThen, "veneerd", "run.end", why}); !noted) return noted;
    return r.jobs.abort_run(*run, suspects, why, kThen);
  });
  for (const char* target : {"/history/events?job=1", "/history", "/jobs/1", "/audit?kind=run", "/audit?kind=api"}) {
    role = Role::kOperator;
    EXPECT_THAT(get(target).dump(), ::testing::HasSubstr("/dev/ttyUSB7")) << target;
    role = Role::kViewer;
    const std::string told = get(target).dump();
    EXPECT_THAT(told, ::testing::HasSubstr("does not answer")) << target;
    EXPECT_THAT(told, Not(::testing::HasSubstr("/dev/ttyUSB7"))) << target;
    EXPECT_THAT(told, Not(::testing::HasSubstr("wire.bin"))) << target;
  }
  EXPECT_THAT(get("/audit?kind=api").dump(), ::testing::HasSubstr("POST /api/v1/laser/connect?port=(an operator"));
}

TEST_F(EventHistory, WhatPeopleTypedReadsTheSameForAll) {
  change([&](Repositories& r) -> Status {
    db::NewPlan plan = squares(6, {25}, 5);
    plan.name = "a /b";
    if (const auto job = r.jobs.create(plan, kThen); !job) return job.error();
    return r.ledger.write_off(PanelId{"P-0001"}, Region<PanelFrame>(panel_square(5, 5, 5)), "as in /notes", kThen);
  });
  for (const auto& [target, typed] : {std::pair("/history", "a /b"), std::pair("/history/wood", "as in /notes")}) {
    role = Role::kViewer;
    const json seen = get(target);
    EXPECT_THAT(seen.dump(), ::testing::HasSubstr(typed));
    role = Role::kOperator;
    EXPECT_EQ(seen, get(target));
  }
}

TEST_F(EventHistory, RefusesWhatIsNoFilter) {
  for (const char* query :
       {"job=0", "job=x", "piece=-1", "panel=%25", "since=yesterday", "cursor=7", "limit=0", "kind=%25", "kind=jobs",
        "cursor=2026~x", "cursor=zzz~job~0~1~", "cursor=2026-05-01T07:30:00.000Z~1.5",
        "cursor=2026-05-01T07:30:00.000Z~job~0~1.5~", "cursor=2026-05-01T07:30:00.000Z~jobs~0~1~",
        "cursor=2026-05-01T07:30:00.000Z~job~0~1~x", "cursor=2026-05-01T07:30:00.000Z~job~0~1"})
    EXPECT_EQ(ask("GET", std::string("/api/v1/history/events?") + query).status, 400) << query;
}

}  // namespace
}  // namespace veneer::daemon
