// The program itself: its arguments, a daemon that is there or not, tasks, and its exit status.
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <future>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temp_directory.h"
#include "tests/support/veneerctl_run.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using testing::ApiServer;
using testing::ask;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcome;
using testing::veneerctl;
using testing::Veneerctl;

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

TEST(Veneerctl, AnUnknownOptionIsNamedWithTheNearestOneOfItsCommand) {
  const auto said = [](std::vector<std::string> arguments) {
    const Outcome outcome = veneerctl(std::move(arguments));
    EXPECT_EQ(outcome.status, 2);
    return outcome.err;
  };
  EXPECT_EQ(said({"panel", "scan", "--pannel", "P-0001"}),
            "veneerctl: unknown option --pannel: did you mean --panel?\n");
  EXPECT_EQ(said({"job", "redo", "1", "--lsot"}), "veneerctl: unknown option --lsot: did you mean --lost?\n");
  EXPECT_EQ(said({"--jsno", "status"}), "veneerctl: unknown option --jsno: did you mean --json?\n");
  EXPECT_EQ(said({"status", "--lost"}),
            "veneerctl: unknown option --lost: `veneerctl status --help` lists those there are\n")
      << "which another command has";
  EXPECT_EQ(said({"job", "list", "-q"}),
            "veneerctl: unknown option -q: `veneerctl job list --help` lists those there are\n");
  EXPECT_THAT(said({"plan", "--target", "a", "--pannel=b", "--out", "c"}), HasSubstr("did you mean --panel?"))
      << "which is required";
  EXPECT_THAT(said({"job", "list", "--", "first"}), Not(HasSubstr("unknown option")));
  EXPECT_THAT(said({"job", "list", "-\xc3\xa4"}), HasSubstr("unknown option -\xc3\xa4"));
  EXPECT_THAT(said({"job", "redo", "1", "--lost"}), HasSubstr("name the pieces that are lost"));
  EXPECT_THAT(said({"job", "strat", "--al"}), HasSubstr("perhaps `veneerctl job start` is meant"));
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

TEST(Veneerctl, TheNextStepIsNamedAfterWhatNamesNone) {
  ApiServer server({}, {}, [](Router& router) {
    router.bind("command", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json({{"state", "Idle"}, {"reason", "Ready."}}));
    });
    router.bind("startJob", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json({{"state", "Starting"}, {"reason", "see `veneerctl status`"}}));
    });
    router.bind("getStatus", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json(
          {{"next_step",
            {{"step", "start"}, {"sentence", "Job 1 waits: Start."}, {"command", "veneerctl job start 1"}}}}));
    });
  });
  EXPECT_EQ(ask(server, {"reset"}).out, "Idle: Ready.\nNext: " + ask(server, {"next"}).out);
  EXPECT_EQ(ask(server, {"job", "start", "1"}).out, "Starting: see `veneerctl status`\n") << "it names one itself";
  EXPECT_FALSE(json::parse(ask(server, {"--json", "reset"}).out).contains("next_step")) << "scripts ask for it";
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

}  // namespace
}  // namespace veneer::daemon
