// veneerctl job: pictures, plans and leases.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/files.h"
#include "planner/plan_options.h"
#include "tests/support/temp_directory.h"
#include "tests/support/veneerctl_run.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using testing::ApiServer;
using testing::ask;
using testing::Outcome;
using testing::veneerctl;

TEST(VeneerctlJobs, WhatIsNoPictureIsNamedAsItWasGiven) {
  const testing::TempDirectory folder;
  const std::string file = folder / "text.jpg";
  std::ofstream(file) << "no picture";
  ApiServer server({}, {}, [](Router& router) {
    router.bind("newJob", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::error({ErrorCode::kInvalidArgument, "text is not a picture that can be read: save it as PNG"}));
    });
  });
  EXPECT_EQ(ask(server, {"job", "new", file}).err,
            "veneerctl: " + file + " is not a picture that can be read: save it as PNG\n");
}

TEST(VeneerctlJobs, ANewJobSendsThePictureAndShowsProgress) {
  std::optional<TaskReporter> work;
  std::map<std::string, std::string> query;
  std::string body;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("newJob", [&](const ApiRequest& request, const Reply& reply) {
      query = request.query;
      body = request.body.text();
      work = running->tasks().start("plan", "matching patches");
      work->done({{"job", 7}});
      reply(ApiReply::task(work->id()));
    });
  });
  running = &server;
  const std::string picture = (server.folder() / "grace hopper.png").string();
  std::ofstream(picture) << "a picture";
  const Outcome outcome =
      ask(server, {"job", "new", picture, "--size-mm", "120.5", "--rotations", "15", "--fine-rotation"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("veneerctl job start 7"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.err, "matching patches\n");
  EXPECT_EQ(body, "a picture");
  EXPECT_EQ(query["name"], "grace hopper");
  EXPECT_EQ(query["size_mm"], "120.5");
  EXPECT_EQ(query["rotations"], "15");
  EXPECT_EQ(query["fine_rotation"], "1");
}

TEST(VeneerctlJobs, ANewJobPassesEveryOptionOn) {
  std::map<std::string, std::string> query;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("newJob", [&](const ApiRequest& request, const Reply& reply) {
      query = request.query;
      const TaskReporter work = running->tasks().start("plan", "");
      work.done({{"job", 7}});
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const std::string picture = (server.folder() / "p.png").string();
  std::ofstream(picture) << "a picture";
  std::vector<std::string> arguments = {
      "job",     "new",      picture,       "--panels", "P-1,P-2",     "--panels",      "P-3",   "--max-panels",
      "2",       "--wood",   "oak",         "--wood",   "ash",         "--wood-weight", "oak=2", "--material-limit",
      "oak=0.5", "--forbid", "P-1,1,2,3,4", "--forbid", "P-2,5,6,7,8", "--size-mm",     "100",   "--no-remnants-first"};
  std::map<std::string, std::string> expected = {{"name", "p"},
                                                 {"panels", "P-1,P-2,P-3"},
                                                 {"max_panels", "2"},
                                                 {"wood", "oak,ash"},
                                                 {"wood_weight", "oak=2"},
                                                 {"wood_limit", "oak=0.5"},
                                                 {"forbid", "P-1,1,2,3,4;P-2,5,6,7,8"},
                                                 {"size_mm", "100"},
                                                 {"remnants_first", "0"}};
  for (const planner::NamedOption& option : planner::kNamedOptions) {
    std::string flag = "--" + std::string(option.name);
    std::replace(flag.begin(), flag.end(), '_', '-');
    arguments.push_back(flag);
    if (option.kind != planner::OptionKind::kSwitch) arguments.emplace_back("1");
    expected[std::string(option.name)] = "1";
  }
  const Outcome outcome = ask(server, arguments);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(query, expected);
}

TEST(VeneerctlJobs, APlanLeasesItsWoodAndGivesItBack) {
  std::vector<std::string> asked;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"leasePlan", "releasePlan"})
      router.bind(operation, [&asked](const ApiRequest& request, const Reply& reply) {
        asked.push_back(request.method + " " + request.path + " " + request.body.text());
        json plan = {{"id", 5}, {"name", "darker"}, {"pieces", 4}, {"placed", 4}, {"lease", nullptr}};
        if (request.method == "POST")
          plan["lease"] = {{"who", "uid 1000"}, {"since", ""}, {"until", "2026-05-08T07:30:00.123Z"}};
        reply(ApiReply::json(plan));
      });
  });
  EXPECT_NE(ask(server, {"job", "lease", "5"}).out.find("kept until 2026-05-08 07:30:00 UTC for uid 1000"),
            std::string::npos);
  EXPECT_EQ(ask(server, {"job", "lease", "5", "--days", "14"}).status, 0);
  EXPECT_EQ(ask(server, {"job", "release", "5"}).out.find("kept until"), std::string::npos);
  EXPECT_EQ(ask(server, {"job", "lease", "5", "--days", "91"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "lease", "5", "--days", "0"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "release"}).status, 2);
  EXPECT_EQ(server.on_reactor([&] { return asked; }),
            (std::vector<std::string>{R"(POST /api/v1/plans/5/lease {"days":7})",
                                      R"(POST /api/v1/plans/5/lease {"days":14})", "DELETE /api/v1/plans/5/lease "}));
}

TEST(VeneerctlJobs, APlanIsKeptChangedAndBecomesAJob) {
  std::vector<std::string> asked;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"newPlan", "changePlan", "newJob"})
      router.bind(operation, [&asked, &running, operation](const ApiRequest& request, const Reply& reply) {
        asked.push_back(request.path + " " + request.body.text());
        const TaskReporter work = running->tasks().start("plan", "");
        work.done({{std::string(operation) == "newJob" ? "job" : "plan", 5}, {"pieces", 4}});
        reply(ApiReply::task(work.id()));
      });
    const json plan = {{"id", 5},
                       {"name", "darker"},
                       {"parent", 3},
                       {"pieces", 4},
                       {"placed", 4},
                       {"report", {{"cost_per_pixel", 0.0125}}},
                       {"jobs", {7}},
                       {"segmentation", "/api/v1/plans/5/segmentation"},
                       {"outdated_panels", {"P-0001"}},
                       {"lease", {{"until", "2026-05-08T07:30:00.123Z"}}}};
    router.bind("listPlans", [plan](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json({{"plans", {plan}}, {"next", nullptr}}));
    });
    router.bind("getPlan", [plan](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(plan)); });
    router.bind("getPlanSegmentation", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::bytes("<svg/>", "application/octet-stream"));
    });
    router.bind("getPlanPreview",
                [](const ApiRequest&, const Reply& reply) { reply(ApiReply::bytes("a picture", "image/png")); });
  });
  running = &server;
  const std::string picture = (server.folder() / "p.png").string(), preview = (server.folder() / "plan.png").string();
  std::ofstream(picture) << "a picture";
  EXPECT_NE(ask(server, {"job", "plan", picture}).out.find("`veneerctl job new --plan 5`"), std::string::npos);
  EXPECT_EQ(ask(server, {"job", "change", "5", "--swap", "A1-1,A1-2", "--take", "A2-1=2"}).status, 0);
  EXPECT_NE(ask(server, {"job", "new", "--plan", "5"}).out.find("Job 5 (4 pieces)"), std::string::npos);
  EXPECT_EQ(ask(server, {"job", "plans"}).out,
            "PLAN  NAME    OF  PIECES  PLACED     COST  JOBS  LEASED UNTIL             CREATED\n"
            "   5  darker   3       4       4  0.01250  7     2026-05-08 07:30:00 UTC\n");
  const Outcome one = ask(server, {"job", "plans", "5", "--preview", preview});
  EXPECT_NE(one.out.find("P-0001: scanned again since"), std::string::npos) << one.out;
  EXPECT_TRUE(std::ifstream(preview).good());
  EXPECT_NE(one.out.find("veneerctl job plans 5 --segmentation FILE"), std::string::npos) << one.out;
  const std::string drawing = (server.folder() / "d.svg").string();
  EXPECT_EQ(ask(server, {"job", "plans", "5", "--segmentation", drawing}).status, 0);
  EXPECT_EQ(read_whole(drawing).value_or(""), "<svg/>");
  EXPECT_EQ(ask(server, {"job", "plan"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "new"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "new", "--plan", "5", "--rotations", "3"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "plans", "--preview", preview}).status, 2);
  EXPECT_EQ(server.on_reactor([&] { return asked; }),
            (std::vector<std::string>{"/api/v1/plans a picture",
                                      R"(/api/v1/plans/5/changes {"swap":["A1-1,A1-2"],"take":["A2-1=2"]})",
                                      R"(/api/v1/jobs {"plan":5})"}));
}

TEST(VeneerctlJobs, MasksOfAPictureAreCells) {
  std::vector<std::string> asked;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"newPlan", "newJob"})
      router.bind(operation, [&asked, &running](const ApiRequest& request, const Reply& reply) {
        for (const char* mask : {"importance", "large_edges", "fine_edges"})
          if (const auto given = request.query.find(mask); given != request.query.end())
            asked.push_back(request.path + " " + mask + " " + given->second);
        const TaskReporter work = running->tasks().start("plan", "");
        work.done({{"job", 5}, {"plan", 5}, {"pieces", 4}});
        reply(ApiReply::task(work.id()));
      });
  });
  running = &server;
  const std::string picture = (server.folder() / "p.png").string(), mask = (server.folder() / "m.png").string();
  std::ofstream(picture) << "a picture";
  ASSERT_TRUE(cv::imwrite(mask, cv::Mat((cv::Mat_<std::uint8_t>(1, 2) << 255, 0))));
  EXPECT_EQ(ask(server, {"job", "plan", picture, "--importance", mask}).status, 0);
  EXPECT_EQ(
      ask(server, {"job", "new", picture, "--layout", "morph", "--large-edges", mask, "--fine-edges", mask}).status, 0);
  const Outcome none = ask(server, {"job", "plan", picture, "--importance", picture});
  EXPECT_EQ(none.status, 2);
  EXPECT_EQ(none.err, "veneerctl: " + picture + " is no PNG picture: save the mask as one\n");
  EXPECT_EQ(server.on_reactor([&] { return asked; }),
            (std::vector<std::string>{"/api/v1/plans importance 2x1:f0", "/api/v1/jobs large_edges 2x1:8",
                                      "/api/v1/jobs fine_edges 2x1:8"}));
}

TEST(VeneerctlJobs, FilesOfALayoutAreReadAsPlanReadsThem) {
  std::vector<std::string> asked;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"newPlan", "newJob"})
      router.bind(operation, [&asked, &running](const ApiRequest& request, const Reply& reply) {
        std::string line = request.path + " " + request.body.text();
        for (const char* key : {"layout", "large_edges", "fine_edges", "pinned_vertices", "segmentation_bytes",
                                "cell_sizes", "flow_lines"})
          if (const auto given = request.query.find(key); given != request.query.end())
            line += std::string(" ") + key + "=" + given->second;
        asked.push_back(line);
        const TaskReporter work = running->tasks().start("plan", "");
        work.done({{"job", 5}, {"plan", 5}, {"pieces", 4}});
        reply(ApiReply::task(work.id()));
      });
  });
  running = &server;
  const auto file = [&](const char* name) { return (server.folder() / name).string(); };
  std::ofstream(file("p.png")) << "a picture";
  std::ofstream(file("d.svg")) << "<svg/>";
  ASSERT_TRUE(cv::imwrite(file("m.png"), cv::Mat((cv::Mat_<std::uint8_t>(1, 2) << 255, 0))));
  std::ofstream(file("g.json")) << R"({"fine_edges": "m.png", "vertices": [{"row": 1, "column": 2, "x_mm": 30.5,
                                       "y_mm": 4}, {"row": 2, "column": 2, "x_mm": 1, "y_mm": 2}]})";
  EXPECT_EQ(
      ask(server, {"job", "plan", "--layout", "segmentation", "--segmentation", file("d.svg"), file("p.png")}).status,
      0);
  EXPECT_EQ(ask(server, {"job", "new", file("p.png"), "--layout", "morph", "--guides", file("g.json")}).status, 0);
  std::ofstream(file("l.svg"))
      << "<svg width='8mm' height='4mm' viewBox='0 0 8 4'><path d='M0 2H8' fill='none'/></svg>";
  EXPECT_EQ(ask(server, {"job", "new", file("p.png"), "--layout", "mosaic", "--cell-sizes", file("m.png"),
                         "--flow-lines", file("l.svg")})
                .status,
            0);
  EXPECT_EQ(server.on_reactor([&] { return asked; }),
            (std::vector<std::string>{"/api/v1/plans a picture<svg/> layout=segmentation segmentation_bytes=6",
                                      "/api/v1/jobs a picture layout=morph fine_edges=2x1:8 "
                                      "pinned_vertices=1,2,30.5,4;2,2,1,2",
                                      "/api/v1/jobs a picture layout=mosaic cell_sizes=2x1:f0 "
                                      "flow_lines=8x4:0,5000 10000,5000"}));

  const auto refusal = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command{"job", "new", file("p.png")};
    command.insert(command.end(), options.begin(), options.end());
    const Outcome outcome = ask(server, command);
    EXPECT_EQ(outcome.status, 2);
    return outcome.err;
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(refusal({"--segmentation", file("d.svg")}), HasSubstr("add --layout segmentation"));
  EXPECT_THAT(refusal({"--guides", file("g.json"), "--layout", "mosaic"}), HasSubstr("add --layout morph"));
  EXPECT_THAT(refusal({"--layout", "morph", "--guides", file("g.json"), "--fine-edges", file("m.png")}),
              HasSubstr("give one of them"));
  EXPECT_THAT(refusal({"--layout", "morph", "--guides", ""}), HasSubstr("names no file"));
  std::ofstream(file("empty.svg")) << "";
  EXPECT_THAT(refusal({"--layout", "segmentation", "--segmentation", file("empty.svg")}),
              HasSubstr("empty.svg is empty: save it again"));
  EXPECT_EQ(server.on_reactor([&] { return asked.size(); }), 3U) << "nothing was sent";
}

// The daemon reads the picture, and so sees whether a drawing has its shape; who sent them is told of the file.
TEST(VeneerctlJobs, ADrawingThatTheDaemonRefusesIsNamedByItsFile) {
  ApiServer server({}, {}, [](Router& router) {
    router.bind("newJob", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::error({ErrorCode::kInvalidArgument, "flow_lines: the drawing has a page of 8 x 4 mm"}));
    });
  });
  const auto file = [&](const char* name) { return (server.folder() / name).string(); };
  std::ofstream(file("p.jpg")) << "a picture";
  std::ofstream(file("l.svg")) << "<svg viewBox='0 0 8 4'><path d='M0 2H8' fill='none'/></svg>";
  const Outcome outcome =
      ask(server, {"job", "new", file("p.jpg"), "--layout", "mosaic", "--flow-lines", file("l.svg")});
  EXPECT_NE(outcome.status, 0);
  EXPECT_THAT(outcome.err,
              ::testing::HasSubstr("--flow-lines " + file("l.svg") + ": the drawing has a page of 8 x 4 mm"));
}

TEST(VeneerctlJobs, AMissingPictureIsNamed) {
  ApiServer server;
  const Outcome outcome = ask(server, {"job", "new", "/nowhere/grace.jpg", "--json"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "veneerctl: there is no file /nowhere/grace.jpg\n");
  EXPECT_EQ(json::parse(outcome.out)["error"]["code"], "not_found");
}

}  // namespace
}  // namespace veneer::daemon
