// Jobs as the API has them, on a cell whose laser is a file.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <future>

#include "cli/render.h"
#include "daemon/api/idempotency.h"
#include "daemon/news/cell_counts.h"
#include "planner/files/plan_files.h"
#include "tests/support/routed_cell.h"
#include "tests/support/task_json.h"

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
    return testing::json_of(*cell->tasks.find(id));
  }
  std::size_t jobs() { return body_of(ask("GET", "/api/v1/jobs"))["jobs"].size(); }
};

TEST_F(JobRoutes, APlanTellsWhereTheDrawingOfItsPiecesIs) {
  const auto kept = cell->panel_library.store_bytes("<svg/>", "drawings", "d");
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  const auto add = [&](const json& options) {
    db::NewPlan plan;
    plan.name = "picture", plan.plan_json = "{}", plan.options_json = options.dump();
    EXPECT_TRUE(cell->database->call([&](Repositories& r) { return r.plans.add(plan, "2026-05-01T07:30:00.000Z"); }));
  };
  add({{"segmentation_bytes", 6}, {"segmentation_file", kept->file}});
  add({{"segmentation_bytes", nullptr}});
  add({{"segmentation_bytes", 6}});
  add({{"segmentation_bytes", nullptr}, {"layout", "segmentation"}});  // of no drawing, or changed by an old version
  const json plan = body_of(ask("GET", "/api/v1/plans/1"));
  EXPECT_EQ(plan["options"], json({{"segmentation_bytes", 6}}));
  ASSERT_TRUE(plan["segmentation"].is_string()) << plan;
  const ApiReply drawing = ask("GET", plan["segmentation"].get<std::string>());
  EXPECT_EQ(drawing.status, 200) << drawing.body;
  EXPECT_EQ(drawing.body, "<svg/>");
  EXPECT_EQ(drawing.content_type, "application/octet-stream") << "no page whose scripts would run";
  EXPECT_THAT(drawing.headers, ::testing::Contains(std::pair<std::string, std::string>(
                                   "Content-Disposition", "attachment; filename=\"plan-1-drawing.svg\"")));
  for (const auto& [id, why] : {std::pair(2, "plan 2 was made of no drawing"), std::pair(3, "was not kept"),
                                std::pair(4, "no drawing of plan 4 was kept")}) {
    const std::string path = fmt::format("/api/v1/plans/{}", id);
    EXPECT_EQ(body_of(ask("GET", path))["segmentation"], json());
    const ApiReply none = ask("GET", path + "/segmentation");
    EXPECT_EQ(none.status, 404);
    EXPECT_NE(none.body.find(why), std::string::npos) << none.body;
  }
}

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

// Sixteen of the largest would be 1 GiB of the process that owns the laser.
TEST_F(JobRoutes, PicturesThatWaitForThePlannerHaveABoundOfTheirOwn) {
  std::promise<void> begun, busy;
  cell->planner_worker->post([&begun, wait = busy.get_future().share()] {
    begun.set_value();
    wait.wait();
  });
  begun.get_future().wait();
  const std::string large(kPictureBody / 4 * 3, 'x');
  EXPECT_EQ(ask_raw("POST", "/api/v1/jobs", large).status, 202);
  EXPECT_EQ(ask_raw("POST", "/api/v1/plans", large).status, 202);
  for (const char* route : {"/api/v1/jobs", "/api/v1/plans", "/api/v1/plans/advice"}) {
    const ApiReply refused = ask_raw("POST", route, large);
    EXPECT_EQ(refused.status, 503) << route;
    EXPECT_EQ(body_of(refused)["error"]["sentence"],
              "the pictures that wait already leave no room for one of 48.0 MiB");
  }
  EXPECT_EQ(cell->tasks.list().size(), 2U) << "no task is left of what was refused";
  EXPECT_EQ(ask_raw("POST", "/api/v1/jobs", "a small picture").status, 202);
  EXPECT_EQ(ask_raw("POST", "/api/v1/jobs", R"({"plan":1})").status, 202);
  busy.set_value();
}

// The route takes pictures of 64 MiB, which the reactor only hands on; JSON it reads itself.
TEST_F(JobRoutes, AJobOfAPlanIsReadOnlyWhenItIsSmall) {
  const std::string padding(kSmallBody, ' ');
  const ApiReply refused = ask_raw("POST", "/api/v1/jobs", "{\"plan\":1" + padding + "}");
  EXPECT_EQ(refused.status, 413) << refused.body;
  EXPECT_EQ(body_of(refused)["error"]["sentence"], "the JSON of this request is larger than 64 KiB");
  EXPECT_TRUE(cell->tasks.list().empty());
  EXPECT_EQ(ask_raw("POST", "/api/v1/jobs", R"({"plan":1})").status, 202);
}

TEST_F(JobRoutes, TheMapOfAJobIsDrawnFromItsPlan) {
  planner::Plan plan;
  plan.artworks = {{"face.png", "A", Millimetres(14), Millimetres(14)}};
  plan.dpi = 75, plan.kerf = 0.15_mm;
  planner::Piece piece;
  piece.mark = "A1-1";
  piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(14, 0), point<ArtworkFrame>(14, 14),
                           point<ArtworkFrame>(0, 14)};
  plan.pieces = {piece};
  const auto made = cell->database->call([&](Repositories& r) {
    db::NewPlan job;
    job.name = "face", job.options_json = "{}", job.plan_json = planner::plan_to_json(plan);
    return r.jobs.create(job, "2026-05-01T07:30:00.000Z");
  });
  ASSERT_TRUE(made.ok()) << made.error().message;
  for (const char* of : {"jobs", "plans"}) {
    const std::string map = fmt::format("/api/v1/{}/1/map", of);
    const ApiReply pdf = ask("GET", map);
    EXPECT_EQ(pdf.status, 200) << pdf.body;
    EXPECT_EQ(pdf.body.substr(0, 5), "%PDF-");
    const ApiReply svg = ask("GET", map + "?format=svg&view=show&scale=1:1&paper=a3");
    EXPECT_EQ(svg.status, 200) << svg.body;
    EXPECT_NE(svg.body.find("<svg"), std::string::npos);
    EXPECT_EQ(ask("GET", map + "?view=side").status, 400);
    EXPECT_EQ(ask("GET", fmt::format("/api/v1/{}/9/map", of)).status, 404);
  }
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

TEST_F(JobRoutes, ArchivedJobsAreListedOnlyWhenAskedFor) {
  for (int i = 0; i < 3; ++i) plan_for("uid 1000", fmt::format("key-{}", i));
  EXPECT_EQ(ask("POST", "/api/v1/jobs/1/archive").status, 409) << "it is planned";
  EXPECT_EQ(ask("POST", "/api/v1/jobs/1/cancel").status, 200);
  EXPECT_EQ(ask("POST", "/api/v1/jobs/2/cancel").status, 200);
  EXPECT_EQ(body_of(ask("POST", "/api/v1/jobs/1/archive"))["archived"], true);
  EXPECT_EQ(jobs(), 2U);
  EXPECT_EQ(body_of(ask("POST", "/api/v1/jobs/archive-done"))["jobs"], json::array({2}));
  EXPECT_EQ(jobs(), 1U);
  EXPECT_EQ(body_of(ask("GET", "/api/v1/jobs?archived=true"))["jobs"].size(), 3U);
  EXPECT_EQ(body_of(ask("POST", "/api/v1/jobs/2/unarchive"))["archived"], false);
  EXPECT_EQ(jobs(), 2U);
  EXPECT_EQ(ask("POST", "/api/v1/jobs/9/archive").status, 404);
}

TEST_F(JobRoutes, TheQueueIsInTheOrderThatPeopleChoose) {
  const Status made = cell->database->call([](Repositories& r) -> Status {
    const std::string at = "2026-05-01T07:30:00.000Z";
    db::PanelRecord panel;
    panel.id = PanelId{"P-0001"}, panel.name = "oak", panel.created_at = at;
    panel.width = panel.height = Millimetres(100);
    if (Status added = r.panels.add(panel, {}, {}); !added) return added;
    for (const double x : {10.0, 30.0, 50.0}) {
      db::NewPlan plan;
      plan.name = "Grace", plan.plan_json = plan.options_json = "{}";
      db::PlannedPatch& piece = plan.pieces.emplace_back();
      piece.mark = "A1";
      piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(9, 0), point<ArtworkFrame>(9, 9)};
      piece.panel = panel.id;
      piece.panel_outline = {point<PanelFrame>(x, 5), point<PanelFrame>(x + 9, 5), point<PanelFrame>(x + 9, 14)};
      piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.3));
      plan.planned_on = {{panel.id, 1}};
      if (const auto job = r.jobs.create(plan, at); !job) return job.error();
    }
    return Ok();
  });
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto places = [this] {
    std::vector<json> out;
    const json told = body_of(ask("GET", "/api/v1/jobs"));
    for (const json& job : told["jobs"]) out.push_back(job["queue_place"]);
    return out;
  };
  EXPECT_EQ(places(), (std::vector<json>{1, 2, 3}));
  const auto counted = [this] { return cell->database->call([](Repositories& r) { return count_cell(r); })->job->id; };
  EXPECT_EQ(counted(), 1);
  const auto move = [this](int job, const std::string& body) {
    return ask_raw("POST", fmt::format("/api/v1/jobs/{}/move", job), body);
  };
  const auto queue = [&](int job, const std::string& body) {
    const ApiReply reply = move(job, body);
    EXPECT_EQ(reply.status, 200) << reply.body;
    return body_of(reply)["jobs"];
  };
  EXPECT_EQ(queue(3, R"({"before":1})"), json({3, 1, 2}));
  EXPECT_EQ(places(), (std::vector<json>{2, 3, 1}));
  EXPECT_EQ(counted(), 3) << "the next step leads to it";
  EXPECT_EQ(queue(1, "{}"), json({3, 2, 1})) << "behind all";
  EXPECT_EQ(queue(1, "{}"), json({3, 2, 1})) << "it stands there";
  EXPECT_EQ(ask("POST", "/api/v1/jobs/2/cancel").status, 200);
  EXPECT_EQ(places(), (std::vector<json>{2, nullptr, 1}));
  EXPECT_TRUE(body_of(ask("GET", "/api/v1/jobs/2"))["queue_place"].is_null());
  EXPECT_EQ(body_of(ask("GET", "/api/v1/jobs/3"))["queue_place"], 1);
  EXPECT_EQ(move(1, R"({"before":2})").status, 409) << "it does not wait";
  EXPECT_EQ(move(2, "{}").status, 409);
  EXPECT_EQ(move(9, "{}").status, 404);
  EXPECT_EQ(move(1, R"({"before":9})").status, 404);
  for (const char* body : {R"({"before":1})", R"({"before":"3"})", R"({"before":null})", R"({"after":3})", "[]"})
    EXPECT_EQ(move(1, body).status, 400) << body;
}

// What is left to do for a job is told with it, and in the status for the one that a crash broke off.
TEST_F(JobRoutes, SaysWhatIsToBeDoneNextForAJob) {
  const Status made = cell->database->call([](Repositories& r) -> Status {
    const std::string at = "2026-05-01T07:30:00.000Z";
    db::PanelRecord panel;
    panel.id = PanelId{"P-0001"}, panel.name = "oak", panel.created_at = at;
    panel.width = panel.height = Millimetres(100);
    if (Status added = r.panels.add(panel, {}, {}); !added) return added;
    db::NewPlan plan;
    plan.name = "Grace", plan.plan_json = plan.options_json = "{}";
    for (const double x : {10.0, 30.0}) {
      db::PlannedPatch& piece = plan.pieces.emplace_back();
      piece.mark = x < 20 ? "A1" : "A2";
      piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(9, 0), point<ArtworkFrame>(9, 9)};
      piece.panel = panel.id;
      piece.panel_outline = {point<PanelFrame>(x, 5), point<PanelFrame>(x + 9, 5), point<PanelFrame>(x + 9, 14)};
      piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.3));
    }
    plan.planned_on = {{panel.id, 1}};
    const auto job = r.jobs.create(plan, at);
    if (!job) return job.error();
    const auto run = r.jobs.start_run(*job, panel.id, {}, Millimetres(0), at);
    if (!run) return run.error();
    return r.jobs.mark_cutting(PieceId{1}, at);
  });
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_TRUE(body_of(ask("GET", "/api/v1/jobs/1"))["now"].is_null());
  const auto recovered =
      cell->database->call([](Repositories& r) { return r.jobs.recover("2026-05-01T07:31:00.000Z"); });
  ASSERT_TRUE(recovered.ok());
  cell->runner->begin(*recovered);
  cell->database->call([](Repositories&) { return 0; });
  reactor.restart();
  reactor.poll();
  const json job = body_of(ask("GET", "/api/v1/jobs/1"));
  EXPECT_EQ(job["state"], "aborted");
  EXPECT_EQ(job["next"],
            "0 of 2 pieces of job 1 are cut, 1 is suspect and 1 is still to be cut: Clear, Reset, look at the "
            "suspect piece and say what became of it (veneerctl job settle 1), then Start cuts the rest (veneerctl job "
            "start 1)");
  EXPECT_EQ(body_of(ask("GET", "/api/v1/jobs"))["jobs"][0]["next"], job["next"]);
  EXPECT_EQ(body_of(ask("GET", "/api/v1/status"))["next"], job["next"]);
  EXPECT_EQ(job["suspects"], (json{{{"mark", "A1"}, {"panel", "P-0001"}, {"sighting", nullptr}}}));
  const auto see = [&](int mask_version) {
    return cell->database->call([mask_version](Repositories& r) -> Status {
      const std::pair seen(db::AllocationId{1},
                           db::Sighting{db::Seen::kCut, 0.98, mask_version, "2026-05-01T09:00:00.000Z"});
      return r.jobs.note_sightings({&seen, 1});
    });
  };
  ASSERT_TRUE(see(2)) << "a map that is not there any more";
  EXPECT_EQ(ask("POST", "/api/v1/jobs/1/settle-as-seen", json::object()).status, 409) << "its scan does not count";
  EXPECT_FALSE(body_of(ask("GET", "/api/v1/jobs/1/pieces"))["pieces"][0].contains("sighting")) << "nor is it told";
  EXPECT_EQ(body_of(ask("GET", "/api/v1/jobs/1"))["suspects"][0]["sighting"], nullptr);
  ASSERT_TRUE(see(1));
  const json sighting = {
      {"seen", "cut"}, {"gone_share", 0.98}, {"mask_version", 1}, {"at", "2026-05-01T09:00:00.000Z"}};
  const json pieces = body_of(ask("GET", "/api/v1/jobs/1/pieces"));
  EXPECT_EQ(pieces["pieces"][0]["sighting"], sighting);
  EXPECT_FALSE(pieces["pieces"][1].contains("sighting"));
  const std::string words = "the scan of 2026-05-01 saw its wood gone (98 %), so it was cut\n";
  EXPECT_NE(cli::render_pieces(pieces).find("suspect: " + words), std::string::npos);
  EXPECT_NE(cli::render_job(body_of(ask("GET", "/api/v1/jobs/1"))).find("A1 on P-0001: " + words), std::string::npos);
  const json settled = body_of(ask("POST", "/api/v1/jobs/1/pieces/A1/settle", {{"verdict", "cut"}}));
  EXPECT_EQ(settled["next"],
            "1 of 2 pieces of job 1 is cut and 1 is still to be cut: Clear, Reset, then Start cuts the rest "
            "(veneerctl job start 1)");
  EXPECT_EQ(settled["assembled"], 0);
  const auto tick = [&](const json& body) { return ask("POST", "/api/v1/jobs/1/assembled", body); };
  const json laid = body_of(tick({{"pieces", {"A1"}}}));
  EXPECT_EQ(laid["assembled"], 1) << laid;
  const json told = body_of(ask("GET", "/api/v1/jobs/1/pieces"))["pieces"];
  EXPECT_EQ(told[0]["assembled"]["who"], "uid 1000");
  EXPECT_FALSE(told[1].contains("assembled"));
  EXPECT_EQ(tick({{"pieces", {"A1", "A2"}}}).status, 409) << "the second one is still to be cut";
  EXPECT_EQ(tick({{"pieces", {"Z9"}}}).status, 404);
  EXPECT_EQ(tick({{"assembled", true}}).status, 400) << "which?";
  EXPECT_EQ(body_of(tick({{"pieces", {"A1"}}, {"assembled", false}}))["assembled"], 0);
  const auto entries = cell->database->call([](Repositories& r) { return *r.audit.latest(1); });
  EXPECT_EQ(entries[0].what, "api.assemblePieces");
  EXPECT_EQ(entries[0].who, "uid 1000");
  EXPECT_EQ(body_of(ask("GET", "/api/v1/jobs/1"))["runs"][0]["who"], nullptr) << "nobody noted it";
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

TEST_F(JobRoutes, NothingIsLostThatNobodyNames) {
  const ApiReply refused = ask("POST", "/api/v1/jobs/1/redo", {{"lost", true}});
  EXPECT_EQ(refused.status, 400) << refused.body;
  EXPECT_THAT(refused.body, ::testing::HasSubstr("name the pieces that are lost"));
  EXPECT_TRUE(cell->tasks.list().empty());
}

}  // namespace
}  // namespace veneer::daemon
