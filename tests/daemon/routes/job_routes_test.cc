// Jobs as the API has them, on a cell whose laser is a file.
#include <fmt/format.h>

#include <future>

#include "daemon/api/idempotency.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

class JobRoutes : public testing::RoutedCell {
 protected:
  // As PlanService leaves a job behind, planned for the request with this key of this sender.
  void plan_for(const std::string& who, const std::string& key) {
    ApiRequest request;
    request.caller.who = who;
    request.idempotency_key = key;
    request.method = "POST";
    request.path = "/api/v1/jobs";
    request.body = "a picture";
    const auto wanted = read_job_request(request);
    ASSERT_TRUE(wanted.ok());
    const auto made = cell->database->call([&](Repositories& r) {
      db::NewPlan job;
      job.name = wanted->name;
      job.options_json = options_json(*wanted).dump();
      job.plan_json = "{}";
      EXPECT_TRUE(r.request_keys.begin(*wanted->keyed, "2026-05-01T07:30:00.000Z").ok());
      return r.jobs.create(job, "2026-05-01T07:30:00.000Z", wanted->keyed);
    });
    ASSERT_TRUE(made.ok()) << made.error().message;
  }
  json new_job(const std::string& key) {
    idempotency_key = key;
    const ApiReply begun = ask_raw("POST", "/api/v1/jobs", "a picture");
    EXPECT_EQ(begun.status, 202) << begun.body;
    const auto id = body_of(begun).value("task", 0);
    while (cell->tasks.find(id)->state == TaskState::kRunning) {
      reactor.restart();
      reactor.run_one_for(std::chrono::seconds(10));
    }
    return to_json(*cell->tasks.find(id));
  }
  std::size_t jobs() { return body_of(ask("GET", "/api/v1/jobs"))["jobs"].size(); }
};

TEST_F(JobRoutes, ARepeatedRequestForAJobIsAnsweredWithTheJobAlsoAfterARestart) {
  plan_for("uid 1000", "key-1");
  // This cell has never seen the request: it stands for the daemon's next life.
  const json repeated = new_job("key-1");
  EXPECT_EQ(repeated["state"], "done") << repeated;
  EXPECT_EQ(repeated["result"]["job"], 1);
  EXPECT_EQ(repeated["result"]["repeated"], true);
  EXPECT_EQ(jobs(), 1U);
  // Another key is another request; it is planned, and fails for want of a picture.
  EXPECT_EQ(new_job("key-2")["state"], "failed");
  const auto left = cell->database->call([](Repositories& r) {
    return r.request_keys.begin({"uid 1000", "newJob", "key-2", "another"}, "2026-05-01T07:30:00.000Z");
  });
  EXPECT_TRUE(left.ok()) << "what failed is forgotten";
}

// Whoever gets a 202 has a task that will be done.
TEST_F(JobRoutes, WhatThePlannerHasNoRoomForIsRefusedAtOnce) {
  std::promise<void> begun, busy;
  cell->planner_worker->post([&begun, wait = busy.get_future().share()] {
    begun.set_value();
    wait.wait();
  });
  begun.get_future().wait();
  std::vector<int> statuses;
  ApiReply last;
  for (int i = 0; i < 40 && last.status < 400; ++i) {
    last = ask_raw("POST", i % 2 == 0 ? "/api/v1/jobs" : "/api/v1/plans", "a picture");
    if (last.status == 202) statuses.push_back(last.status);
  }
  EXPECT_GE(statuses.size(), 16U);
  EXPECT_EQ(last.status, 503);
  EXPECT_EQ(last.headers, (std::vector<std::pair<std::string, std::string>>{{"Retry-After", "1"}}));
  EXPECT_EQ(cell->tasks.list().size(), statuses.size()) << "and no task is left of it";
  busy.set_value();
}

TEST_F(JobRoutes, ListsComeInPages) {
  for (int i = 0; i < 5; ++i) plan_for("uid 1000", fmt::format("key-{}", i));
  std::vector<int> seen;
  json cursor = 0;
  for (int pages = 0; !cursor.is_null() && pages < 10; ++pages) {
    const json page = body_of(ask("GET", fmt::format("/api/v1/jobs?limit=2&cursor={}", cursor.dump())));
    EXPECT_LE(page["jobs"].size(), 2U);
    for (const json& job : page["jobs"]) seen.push_back(job["id"]);
    cursor = page["next"];
  }
  EXPECT_EQ(seen, (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_TRUE(body_of(ask("GET", "/api/v1/jobs?limit=5"))["next"].is_null()) << "a full page may be the last";
}

TEST_F(JobRoutes, EveryChangeIsInTheAuditLogWithWhoAskedForIt) {
  plan_for("uid 1000", "key-1");
  EXPECT_EQ(ask("POST", "/api/v1/jobs/1/cancel").status, 200);
  EXPECT_EQ(ask("POST", "/api/v1/jobs/1/cancel").status, 409);
  const auto entries = cell->database->call([](Repositories& r) { return *r.audit.latest(10); });
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[2].who, "uid 1000");
  EXPECT_EQ(entries[2].what, "api.cancelJob");
  EXPECT_EQ(entries[2].detail, "POST /api/v1/jobs/1/cancel");
  EXPECT_EQ(entries[0].what, "api.cancelJob.refused");
}

}  // namespace
}  // namespace veneer::daemon
