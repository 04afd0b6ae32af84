// The program itself: what it prints where, and its exit status.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planner/plan_options.h"
#include "tests/support/api_server.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using testing::ApiServer;
using ::testing::HasSubstr;

struct Outcome {
  int status = -1;
  std::string out, err;
};

class Veneerctl {
 public:
  explicit Veneerctl(std::vector<std::string> arguments) {
    int out[2];
    int err[2];
    if (pipe(out) != 0 || pipe(err) != 0) std::abort();
    pid_ = fork();
    if (pid_ == 0) {
      close(STDIN_FILENO);  // nobody is at a terminal
      open("/dev/null", O_RDONLY);
      dup2(out[1], STDOUT_FILENO);
      dup2(err[1], STDERR_FILENO);
      for (const int fd : {out[0], out[1], err[0], err[1]}) close(fd);
      std::vector<char*> argv = {const_cast<char*>("veneerctl")};
      for (std::string& argument : arguments) argv.push_back(argument.data());
      argv.push_back(nullptr);
      execv(VENEERCTL, argv.data());
      _exit(127);
    }
    close(out[1]);
    close(err[1]);
    out_ = out[0];
    err_ = err[0];
  }
  Veneerctl(const Veneerctl&) = delete;
  Veneerctl& operator=(const Veneerctl&) = delete;
  ~Veneerctl() { finish(); }

  void interrupt() const { kill(pid_, SIGINT); }
  Outcome finish() {
    if (pid_ < 0) return outcome_;
    outcome_.out = read_all(out_);
    outcome_.err = read_all(err_);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    outcome_.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome_;
  }

 private:
  static std::string read_all(int fd) {
    std::string all;
    char chunk[4096];
    for (ssize_t got = 0; (got = read(fd, chunk, sizeof chunk)) > 0;) all.append(chunk, static_cast<std::size_t>(got));
    close(fd);
    return all;
  }
  pid_t pid_ = -1;
  int out_ = -1;
  int err_ = -1;
  Outcome outcome_;
};

Outcome veneerctl(std::vector<std::string> arguments) { return Veneerctl(std::move(arguments)).finish(); }

Outcome ask(const ApiServer& server, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--socket", server.socket()});
  return veneerctl(std::move(arguments));
}

TEST(Veneerctl, UnusableArgumentsAreStatusTwo) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                    {"dance"},
                                                    {"job"},
                                                    {"job", "new"},
                                                    {"job", "start", "x"},
                                                    {"job", "start", "0"},
                                                    {"panel", "scan", "--face", "edge"},
                                                    {"calibrate", "moon"},
                                                    {"sim", "place", "oak"},
                                                    {"job", "new", VENEERCTL, "--seed", "1.5"},
                                                    {"job", "new", VENEERCTL, "--dpi", "fine"},
                                                    {"job", "new", VENEERCTL, "--max-panels", "-1"}}) {
    const Outcome outcome = veneerctl(arguments);
    EXPECT_EQ(outcome.status, 2) << (arguments.empty() ? "" : arguments.back());
    EXPECT_FALSE(outcome.err.empty());
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_EQ(veneerctl({"--help"}).status, 0);
}

TEST(Veneerctl, WithoutADaemonItSaysSoInOneSentence) {
  const Outcome outcome = veneerctl({"--socket", "/nowhere/veneerd.sock", "status"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err,
            "veneerctl: veneerd does not answer at /nowhere/veneerd.sock: start it, or give its --socket\n");
}

// A daemon that hangs: its socket takes connections, and nobody reads what comes.
TEST(Veneerctl, StopThatNobodyConfirmsSaysSoAtOnce) {
  const testing::TempDirectory folder;
  const std::string path = folder / "frozen.sock";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int listening = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(listen(listening, 8), 0);
  const Outcome frozen = veneerctl({"--socket", path, "stop"});
  close(listening);
  EXPECT_EQ(frozen.status, 1);
  EXPECT_EQ(frozen.err, "veneerctl: STOP is NOT confirmed, use the EMERGENCY STOP: veneerd at " + path +
                            " has not answered in 0.8 s\n");
  const Outcome gone = veneerctl({"--socket", "/nowhere/veneerd.sock", "stop"});
  EXPECT_EQ(gone.status, 1);
  EXPECT_THAT(gone.err, HasSubstr("STOP is NOT confirmed, use the EMERGENCY STOP"));
}

TEST(Veneerctl, AnUnknownCommandIsNamedWithTheNearestOne) {
  const auto said = [](std::vector<std::string> arguments) {
    const Outcome outcome = veneerctl(std::move(arguments));
    EXPECT_EQ(outcome.status, 2);
    return outcome.err;
  };
  EXPECT_EQ(said({"job", "strat", "1"}),
            "veneerctl: there is no command `veneerctl job strat`; perhaps `veneerctl job start` is meant: "
            "`veneerctl job --help` lists those there are\n");
  EXPECT_THAT(said({"sttaus"}), HasSubstr("perhaps `veneerctl status` is meant"));
  EXPECT_THAT(said({"cal"}), HasSubstr("perhaps `veneerctl calibrate` is meant"));
  EXPECT_EQ(said({"--json", "xyzzy"}),
            "veneerctl: there is no command `veneerctl xyzzy`: `veneerctl --help` lists those there are\n");
  EXPECT_THAT(said({"job", "start"}), ::testing::Not(HasSubstr("there is no command")));
}

TEST(Veneerctl, NumbersAreRefusedInWords) {
  const std::string huge(309, '9');
  const auto said = [](std::vector<std::string> arguments) {
    const Outcome outcome = veneerctl(std::move(arguments));
    EXPECT_EQ(outcome.status, 2);
    EXPECT_LT(outcome.err.size(), 250U) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(said({"panel", "list", "--patch", "-3"}), HasSubstr("\"-3\" is not a number greater than 0"));
  EXPECT_THAT(said({"panel", "list", "--min-free", "-3"}), HasSubstr("\"-3\" is not a number from 0 up"));
  EXPECT_THAT(said({"panel", "list", "--patch", "inf"}), HasSubstr("\"inf\" is not a number greater than 0"));
  EXPECT_THAT(said({"job", "start", huge}), HasSubstr("999999999999... (309 digits)"));
  EXPECT_THAT(said({"plan", "--target", "a", "--panel", "b", "--out", "c", "--patch-mm", huge}),
              HasSubstr("(309 digits)"));
}

TEST(Veneerctl, WhatIsNoPictureIsNamedAsItWasGiven) {
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

TEST(Veneerctl, StatusIsForPeopleAndWithJsonForScripts) {
  ApiServer server({}, {}, [](Router& router) {
    router.bind("getStatus", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json({{"state", "Idle"},
                            {"reason", "Ready."},
                            {"panels", 2},
                            {"job", nullptr},
                            {"laser", {{"connected", true}}}}));
    });
  });
  EXPECT_EQ(ask(server, {"status"}).out.substr(0, 15), "Idle\n  Ready.\n\n");
  const json status = json::parse(ask(server, {"status", "--json"}).out);
  EXPECT_EQ(status["schema_version"], 1);
  EXPECT_EQ(status["state"], "Idle");
  EXPECT_EQ(json::parse(veneerctl({"--socket", server.host(), "--json", "status"}).out)["panels"], 2);
}

TEST(Veneerctl, NextSaysOneThing) {
  ApiServer server({}, {}, [](Router& router) {
    router.bind("getStatus", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json(
          {{"state", "Stopped"},
           {"next_step", {{"step", "reset"}, {"sentence", "Reset first."}, {"command", "veneerctl reset"}}}}));
    });
  });
  EXPECT_EQ(ask(server, {"next"}).out, "Reset first.\n  veneerctl reset\n");
}

TEST(Veneerctl, CommandsGoWhereTheyBelong) {
  std::vector<std::string> taken;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("command", [&](const ApiRequest& request, const Reply& reply) {
      taken.push_back(request.path_param("command"));
      reply(ApiReply::json({{"state", "Held"}, {"reason", "Held by uid 0."}}));
    });
  });
  EXPECT_EQ(ask(server, {"hold"}).out, "Held: Held by uid 0.\n");
  for (const char* command : {"hold", "unhold", "unsuspend", "stop", "abort", "clear", "reset", "stop-after-piece"}) {
    EXPECT_EQ(ask(server, {"job", command}).status, 0) << command;
  }
  EXPECT_EQ(taken, (std::vector<std::string>{"hold", "hold", "unhold", "unsuspend", "stop", "abort", "clear", "reset",
                                             "stop-after-piece"}));
  EXPECT_EQ(server.stops(), 0);
  EXPECT_EQ(ask(server, {"stop"}).status, 0);
  EXPECT_EQ(server.stops(), 1);
}

TEST(Veneerctl, EndsWhatConsoleLinksOpened) {
  ApiServer server;
  server.console_session();
  EXPECT_NE(ask(server, {"console"}).out.find("/console#token="), std::string::npos);
  EXPECT_EQ(ask(server, {"console", "--end"}).out, "1 browser signed out, 1 link that nobody had used forgotten.\n");
  EXPECT_EQ(ask(server, {"console", "--end"}).out, "0 browsers signed out, 0 links that nobody had used forgotten.\n");
  EXPECT_EQ(ask(server, {"console", "--end", "--role", "viewer"}).status, 2);
}

TEST(Veneerctl, ANewJobSendsThePictureAndShowsProgress) {
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

TEST(Veneerctl, ANewJobPassesEveryOptionOn) {
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
      "job",         "new",      picture,       "--panels",  "P-1,P-2", "--panels",           "P-3",   "--max-panels",
      "2",           "--wood",   "oak",         "--wood",    "ash",     "--wood-weight",      "oak=2", "--forbid",
      "P-1,1,2,3,4", "--forbid", "P-2,5,6,7,8", "--size-mm", "100",     "--no-remnants-first"};
  std::map<std::string, std::string> expected = {
      {"name", "p"},       {"panels", "P-1,P-2,P-3"}, {"max_panels", "2"},
      {"wood", "oak,ash"}, {"wood_weight", "oak=2"},  {"forbid", "P-1,1,2,3,4;P-2,5,6,7,8"},
      {"size_mm", "100"},  {"remnants_first", "0"}};
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

TEST(Veneerctl, APlanLeasesItsWoodAndGivesItBack) {
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

TEST(Veneerctl, APlanIsKeptChangedAndBecomesAJob) {
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
                       {"outdated_panels", {"P-0001"}},
                       {"lease", {{"until", "2026-05-08T07:30:00.123Z"}}}};
    router.bind("listPlans", [plan](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json({{"plans", {plan}}, {"next", nullptr}}));
    });
    router.bind("getPlan", [plan](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(plan)); });
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
  EXPECT_EQ(ask(server, {"job", "plan"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "new"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "new", "--plan", "5", "--rotations", "3"}).status, 2);
  EXPECT_EQ(ask(server, {"job", "plans", "--preview", preview}).status, 2);
  EXPECT_EQ(server.on_reactor([&] { return asked; }),
            (std::vector<std::string>{"/api/v1/plans a picture",
                                      R"(/api/v1/plans/5/changes {"swap":["A1-1,A1-2"],"take":["A2-1=2"]})",
                                      R"(/api/v1/jobs {"plan":5})"}));
}

TEST(Veneerctl, AMissingPictureIsNamed) {
  ApiServer server;
  const Outcome outcome = ask(server, {"job", "new", "/nowhere/grace.jpg", "--json"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "veneerctl: there is no file /nowhere/grace.jpg\n");
  EXPECT_EQ(json::parse(outcome.out)["error"]["code"], "not_found");
}

TEST(Veneerctl, TheDatabaseIsCheckedOnDemand) {
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("checkIntegrity", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("integrity check", "");
      work.done({{"file", "veneerd.db"}, {"seconds", 1.24}, {"sound", true}});
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const Outcome outcome = ask(server, {"db", "check"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "The database is as it was written; reading it took 1.2 s.\n");
}

json made_backup() {
  return {{"name", "2026-05-01T07-30-00.000Z"},
          {"folder", "/data/backups/2026-05-01T07-30-00.000Z"},
          {"made_at", "2026-05-01T07:30:00.000Z"},
          {"bytes", 12'345'678},
          {"schema", 11},
          {"panels", 2},
          {"jobs", 1},
          {"pieces", 16},
          {"files", 7},
          {"missing", json::array()},
          {"removed", {"2026-04-17T07-30-00.000Z"}}};
}

Outcome ask_for_backup(const json& made) {
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("makeBackup", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("backup", "");
      work.done(made);
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  return ask(server, {"db", "backup"});
}

TEST(Veneerctl, ABackupIsToldWithWhatItHolds) {
  const Outcome outcome = ask_for_backup(made_backup());
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out,
            "The backup /data/backups/2026-05-01T07-30-00.000Z was made and checked: 12.3 MB, 2 panels, 1 jobs, 16 "
            "pieces, 7 pictures.\n1 older one was removed.\n");
}

TEST(Veneerctl, ABackupThatLacksPicturesFailsSoThatSomebodyLooks) {
  json made = made_backup();
  made["missing"] = {"panels/P-0001/map-1.png", "scans/show-2.png"};
  const Outcome outcome = ask_for_backup(made);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.out, HasSubstr("was made and checked"));
  EXPECT_EQ(outcome.err,
            "veneerctl: 2 pictures that the database names are missing or damaged in the data folder, the first is "
            "panels/P-0001/map-1.png: put them back from an older backup; the newest that still has one of "
            "them is kept until then\n");
}

TEST(Veneerctl, BackupsAreListed) {
  json unreadable = {{"name", "2026-04-30T07-30-00.000Z"},
                     {"folder", "/data/backups/2026-04-30T07-30-00.000Z"},
                     {"fault", "its manifest is damaged"}};
  json list = {{"folder", "/data/backups"}, {"backups", {made_backup(), unreadable}}};
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("listBackups", [&](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(list)); });
  });
  const Outcome outcome = ask(server, {"db", "backups"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              HasSubstr("2026-05-01T07:30:00.000Z  12.3 MB       2     1      16         7  /data/backups"));
  EXPECT_THAT(outcome.out, HasSubstr("its manifest is damaged"));
  list["backups"] = json::array();
  EXPECT_EQ(ask(server, {"db", "backups"}).out, "No backups in /data/backups: veneerctl db backup makes one.\n");
}

TEST(Veneerctl, AFailedTaskIsItsSentence) {
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("scan", "");
      work.fail({ErrorCode::kUnavailable, "the scanner does not answer: switch it on"});
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const Outcome outcome = ask(server, {"panel", "scan"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err, "veneerctl: the scanner does not answer: switch it on\n");
}

// Scripts read the exit status: what waits is not in stock.
TEST(Veneerctl, AScanThatWaitsThoughItWasToBeAcceptedFails) {
  ApiServer* running = nullptr;
  json asked;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&](const ApiRequest& request, const Reply& reply) {
      asked = json::parse(request.body.text());
      const TaskReporter work = running->tasks().start("scan", "");
      work.done({{"proposal", 3}, {"new", true}, {"warnings", {{{"name", "size"}, {"text", "not round"}}}}});
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const Outcome looked = ask(server, {"panel", "scan"});
  EXPECT_EQ(looked.status, 0);
  EXPECT_THAT(looked.out, HasSubstr("panel accept 3 --override size"));
  EXPECT_FALSE(asked.contains("accept"));
  const Outcome outcome = ask(server, {"panel", "scan", "--accept"});
  EXPECT_EQ(asked["accept"], true);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("proposal 3 has warnings, and is not in stock"));
  ask(server, {"panel", "scan", "--override", "size", "--override", "strip-1"});
  EXPECT_EQ(asked["override"], json({"size", "strip-1"}));
  EXPECT_EQ(ask(server, {"panel", "scan", "--accept", "--more"}).status, 2);
}

TEST(Veneerctl, PaintsOnMasks) {
  std::vector<std::string> asked;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"editMask", "removeMaskEdit", "listMaskEdits", "mergePanels"})
      router.bind(operation, [&asked](const ApiRequest& request, const Reply& reply) {
        asked.push_back(request.method + " " + request.path + " " + request.body.text());
        reply(ApiReply::json({{"panel", "P-0001"}, {"edits", json::array()}}));
      });
  });
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--give", "1,2 30.5,2 30,40"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--withhold", "1,2 30,2 30,40", "--note", "a stain"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--list"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--remove", "2"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "merge", "P-0001", "P-0002"}).status, 0);
  EXPECT_THAT(asked, ::testing::ElementsAre(
                         "POST /api/v1/panels/P-0001/mask-edits "
                         R"({"kind":"give","outline_mm":[1.0,2.0,30.5,2.0,30.0,40.0]})",
                         "POST /api/v1/panels/P-0001/mask-edits "
                         R"({"kind":"withhold","note":"a stain","outline_mm":[1.0,2.0,30.0,2.0,30.0,40.0]})",
                         "GET /api/v1/panels/P-0001/mask-edits ", "DELETE /api/v1/panels/P-0001/mask-edits/2 ",
                         R"(POST /api/v1/panels/P-0001/merge {"merged":"P-0002"})"));
  for (const char* bad : {"1,2 3,4", "1,2 3,4 5", "1;2 3;4 5;6", "a,b c,d e,f"})
    EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--give", bad}).status, 2) << bad;
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--give", "1,2 3,4 5,6", "--remove", "1"}).status, 2);
}

TEST(Veneerctl, ListsScannersWithWhatTheyTake) {
  ApiServer* running = nullptr;
  const json found = {
      {"scanners",
       {{{"name", "epson2:libusb:001:004"},
         {"make", "EPSON Perfection V39"},
         {"type", "flatbed scanner"},
         {"problem", ""},
         {"options",
          {{{"name", "resolution"}, {"kind", "whole"}, {"unit", "dpi"}, {"value", "75"}, {"numbers", {75, 300, 600}}},
           {{"name", "mode"}, {"kind", "text"}, {"value", "Gray"}, {"words", {"Gray", "Color"}}},
           {{"name", "br-x"},
            {"kind", "number"},
            {"unit", "mm"},
            {"range", {{"least", 0}, {"most", 215.9}, {"step", 0}}}},
           {{"name", "lamp"}, {"kind", "yes_no"}, {"active", false}}}}},
        {{"name", "net:x:y"},
         {"make", "HP"},
         {"type", "scanner"},
         {"problem", "it is busy"},
         {"options", json::array()}}}}};
  json answer = found;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("findScanners", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("find scanners", "");
      work.done(answer);
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const std::string list = ask(server, {"scanner", "list"}).out;
  EXPECT_EQ(list,
            "epson2:libusb:001:004\n"
            "  EPSON Perfection V39, flatbed scanner\n"
            "  resolution         75, 300, 600 dpi [75]\n"
            "  mode               \"Gray\", \"Color\" [Gray]\n"
            "  br-x               0 to 215.9 mm\n"
            "\n"
            "net:x:y\n"
            "  HP, scanner\n"
            "  it is busy\n");
  EXPECT_THAT(ask(server, {"scanner", "list", "--all"}).out,
              HasSubstr("lamp               true, false, with another source or mode only\n"));
  EXPECT_EQ(json::parse(ask(server, {"--json", "scanner", "list"}).out)["scanners"], found["scanners"]);
  answer = {{"scanners", json::array()}};
  EXPECT_THAT(ask(server, {"scanner", "list"}).out, HasSubstr("No scanner is found."));
}

TEST(Veneerctl, CtrlCCancelsTheTask) {
  std::promise<void> started;
  int looks = 0;
  std::optional<TaskReporter> work;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&](const ApiRequest&, const Reply& reply) {
      work = running->tasks().start("scan", "scanning");
      reply(ApiReply::task(work->id()));
    });
    // The first look at the task is the sign that the program has begun to wait, and minds Ctrl-C.
    router.add("GET", "/api/v1/tasks/1", Role::kViewer, [&](const ApiRequest&, const Reply& reply) {
      if (++looks == 1) started.set_value();
      if (work->stop_token().stop_requested()) work->fail({ErrorCode::kCancelled, "the scan was cancelled"});
      reply(ApiReply::bytes(to_text(*running->tasks().find(1)), "application/json"));
    });
  });
  running = &server;
  Veneerctl program({"--socket", server.socket(), "panel", "scan"});
  started.get_future().wait();
  program.interrupt();
  const Outcome outcome = program.finish();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err, "scanning\nveneerctl: the scan was cancelled\n");
}

TEST(Veneerctl, TellsWhatIsConfirmedFramedCutAgainAndSettled) {
  std::vector<std::string> asked;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation :
         {"command", "recut", "settlePiece", "cancelJob", "archiveJob", "unarchiveJob", "archiveDoneJobs"})
      router.bind(operation, [&asked](const ApiRequest& request, const Reply& reply) {
        asked.push_back(request.path + " " + request.body.text());
        reply(ApiReply::json({{"state", "Execute"}}));
      });
  });
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--socket", server.socket()});
    return veneerctl(std::move(arguments)).status;
  };
  EXPECT_EQ(run({"unsuspend", "--confirm", "exhaust", "--confirm", "air assist"}), 0);
  EXPECT_EQ(run({"frame"}), 0);
  EXPECT_EQ(run({"frame", "--power", "2%"}), 0);
  EXPECT_EQ(run({"job", "recut", "3", "A1-1", "A3-12", "--confirm", "exhaust"}), 0);
  EXPECT_EQ(run({"job", "settle", "3", "A1-1", "scrap"}), 0);
  EXPECT_EQ(run({"job", "cancel", "3"}), 0);
  EXPECT_EQ(run({"job", "archive", "3", "4"}), 0);
  EXPECT_EQ(run({"job", "archive", "--all-done"}), 0);
  EXPECT_EQ(run({"job", "unarchive", "4"}), 0);
  EXPECT_NE(run({"job", "archive"}), 0) << "which?";
  EXPECT_NE(run({"job", "archive", "3", "--all-done"}), 0);
  EXPECT_EQ(run({"job", "settle", "3", "A1-1", "fine"}), 2);
  EXPECT_EQ(run({"job", "recut", "3"}), 2);
  EXPECT_EQ(run({"frame", "--power", "200%"}), 2);
  EXPECT_EQ(run({"frame", "--power", "1"}), 2) << "of what?";
  const std::vector<std::string> expected = {
      R"(/api/v1/commands/unsuspend {"confirmed":["exhaust","air assist"]})",
      R"(/api/v1/commands/frame {"power":0.0})",
      R"(/api/v1/commands/frame {"power":0.02})",
      R"(/api/v1/jobs/3/recut {"confirmed":["exhaust"],"pieces":["A1-1","A3-12"]})",
      R"(/api/v1/jobs/3/pieces/A1-1/settle {"verdict":"scrap"})",
      R"(/api/v1/jobs/3/cancel {})",
      R"(/api/v1/jobs/3/archive {})",
      R"(/api/v1/jobs/4/archive {})",
      R"(/api/v1/jobs/archive-done {})",
      R"(/api/v1/jobs/4/unarchive {})"};
  EXPECT_EQ(server.on_reactor([&] { return asked; }), expected);
}

// What is asked before the beam comes on, and what the daemon was then told.
struct Asked {
  explicit Asked(std::vector<std::string> names)
      : confirm(std::move(names)), server({}, {}, [this](Router& router) {
          router.bind("getStatus", [this](const ApiRequest&, const Reply& reply) {
            reply(ApiReply::json({{"state", "Idle"}, {"confirm", confirm}}));
          });
          router.bind("listRecipes", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({})); });
          for (const char* operation : {"laserTestPattern", "laserRun", "burnTestCard"})
            router.bind(operation, [this](const ApiRequest& request, const Reply& reply) {
              const json body = json::parse(request.body.text());
              told.push_back(body.value("dry", false) ? json("dry") : body.value("confirmed", json()));
              reply(ApiReply::json({{"dry", body.value("dry", false)}}));
            });
        }) {}
  Outcome run(std::vector<std::string> arguments) { return ask(server, std::move(arguments)); }
  json taken() {
    return server.on_reactor([&] { return std::exchange(told, json::array()); });
  }

  std::vector<std::string> confirm;
  json told = json::array();
  ApiServer server;
};

TEST(Veneerctl, AScriptSaysInWordsWhatWasSeenToBeforeTheBeamComesOn) {
  const testing::TempDirectory directory;
  const std::string strokes = directory / "strokes.json";
  std::ofstream(strokes)
      << R"({"schema_version":1,"strokes":[{"points_mm":[[0,0],[9,0]],"power":0.5,"speed_mm_s":20}]})";
  const std::vector<std::vector<std::string>> burning = {
      {"laser", "test-pattern"}, {"laser", "run", strokes}, {"recipe", "card", "--burn"}};
  Asked workshop({"exhaust", "air assist"});
  for (const auto& command : burning) {
    const Outcome unsaid = workshop.run(command);
    EXPECT_EQ(unsaid.status, 2) << command[1];
    EXPECT_NE(unsaid.err.find(R"(--confirm exhaust --confirm "air assist")"), std::string::npos) << unsaid.err;
    std::vector<std::string> partly = command;
    partly.insert(partly.end(), {"--confirm", "exhaust"});
    EXPECT_EQ(workshop.run(partly).status, 2);
    EXPECT_EQ(workshop.taken(), json::array()) << "and nothing moved";
    partly.insert(partly.end(), {"--confirm", "air assist"});
    EXPECT_EQ(workshop.run(partly).status, 0);
    EXPECT_EQ(workshop.taken().back(), (json{"exhaust", "air assist"}));
  }
  EXPECT_EQ(workshop.run({"laser", "test-pattern", "--dry"}).status, 0) << "the beam stays off";
  // Where nothing is asked, nothing need be said.
  Asked desk({});
  for (const auto& command : burning) {
    EXPECT_EQ(desk.run(command).status, 0) << command[1];
    EXPECT_EQ(desk.taken().back(), json::array());
  }
}

TEST(Veneerctl, OverridesAreHeldAgainstWhatTheirHelpSays) {
  ApiServer server({}, {}, [](Router& router) {
    router.bind("laserOverrides", [](const ApiRequest& request, const Reply& reply) {
      reply(ApiReply::json({{"taken", true}, {"overrides_wanted", json::parse(request.body.text())}}));
    });
  });
  const std::string help = veneerctl({"laser", "override", "--help"}).out;
  EXPECT_NE(help.find("10 to 100"), std::string::npos) << help;
  EXPECT_NE(help.find("25 to 200"), std::string::npos) << help;
  const Outcome above = ask(server, {"laser", "override", "--power", "110"});
  EXPECT_EQ(above.status, 2);
  EXPECT_NE(above.err.find("10 to 100"), std::string::npos) << above.err;
  EXPECT_EQ(ask(server, {"laser", "override", "--power", "0.5"}).status, 2);
  EXPECT_EQ(ask(server, {"laser", "override", "--power", "50%", "--feed", "150"}).out,
            "Feed 150 %, rapid 100 %, power 50 % of what is asked for, until the job or pattern ends.\n");
}

}  // namespace
}  // namespace veneer::daemon
