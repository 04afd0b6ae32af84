// After each command that changes something veneerctl names what comes next, itself or as the cell says it.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/command_tree.h"
#include "tests/support/child_process.h"
#include "tests/support/veneerctl_run.h"

namespace veneer::cli {
namespace {

using daemon::ApiReply;
using daemon::ApiRequest;
using daemon::Reply;
using daemon::Router;
using testing::ApiServer;
using ::testing::HasSubstr;
using testing::Outcome;

// What each takes, at least. PICTURE and DRAWING are files, a first "<" a password on standard input.
const std::map<std::string, std::vector<std::string>> kChanges = {
    {"alarm acknowledge", {"1"}},
    {"alarm try", {}},
    {"bed look", {}},
    {"calibrate", {"scanner"}},
    {"device choose", {"scanner", "sim"}},
    {"job archive", {"1"}},
    {"job assembled", {"1", "A1-1"}},
    {"job cancel", {"1"}},
    {"job change", {"1", "--replan", "A1-1"}},
    {"job lease", {"1"}},
    {"job move", {"1", "--last"}},
    {"job new", {"PICTURE"}},
    {"job plan", {"PICTURE"}},
    {"job recut", {"1", "A1-1"}},
    {"job redo", {"1"}},
    {"job release", {"1"}},
    {"job settle", {"1", "A1-1", "cut"}},
    {"job start", {"1"}},
    {"job stop", {}},
    {"job unarchive", {"1"}},
    {"laser here", {}},
    {"laser jog", {"--x-mm", "1"}},
    {"laser override", {"--feed", "90"}},
    {"laser run", {"DRAWING", "--power", "10%", "--speed-mm-s", "20"}},
    {"laser test-pattern", {}},
    {"material set", {"walnut", "--origin", "here"}},
    {"panel accept", {"1"}},
    {"panel decide", {"P-0001", "1", "accepted"}},
    {"panel mask", {"P-0001", "--withhold", "1,1 4,1 4,4"}},
    {"panel material", {"P-0001", "walnut"}},
    {"panel merge", {"P-0001", "P-0002"}},
    {"panel refuse", {"1"}},
    {"panel restore", {"P-0001"}},
    {"panel retire", {"P-0001", "--reason", "broken"}},
    {"panel revert", {"P-0001"}},
    {"panel scan", {}},
    {"panel set", {"P-0001", "--shelf", "B7"}},
    {"panel split", {"P-0001"}},
    {"panel zone", {"P-0001", "--outline", "1,1 4,1 4,4"}},
    {"recipe card", {"cut", "--burn", "--dry"}},
    {"recipe remove", {"walnut", "cut"}},
    {"recipe set", {"walnut", "cut", "--speed-mm-s", "20", "--power", "60%"}},
    {"restart", {}},
    {"task cancel", {"1"}},
    {"token revoke", {"bob", "press"}},
    {"user add", {"<", "ann"}},
    {"user password", {"<", "ann"}},
    {"user remove", {"bob"}},
    {"user role", {"ann", "viewer"}},
};
// At the top, and below `job`.
const std::vector<std::string> kToTheUnit = {
    "abort", "clear", "frame", "hold", "reset", "stop-after-piece", "unhold", "unsuspend", "write-off-look"};

// They look and change nothing, or answer with what a program takes from them: a link, a secret, a file.
const std::set<std::string> kAnswers = {"audit",          "bed glance",   "bed picture",       "camera list",
                                        "camera try",     "certificates", "console",           "db backups",
                                        "db check",       "device find",  "device list",       "export history",
                                        "export events",  "export stock", "export wood",       "fiducials print grid",
                                        "job advise",     "job export",   "job list",          "job map",
                                        "job pieces",     "job plans",    "job show",          "material list",
                                        "material show",  "next",         "panel differences", "panel label",
                                        "panel ledger",   "panel list",   "panel proposals",   "panel registration",
                                        "panel remnants", "panel scans",  "panel show",        "piece at",
                                        "piece show",     "recipe list",  "scanner list",      "status",
                                        "task list",      "task show",    "token list",        "token new",
                                        "user list",      "whoami",       "alarm list",        "fiducials print panel"};
// STOP waits for no second answer; a backup is made at night by a timer, and nobody reads on; who signs out is told no
// more, and signing in needs a cell on another machine.
const std::set<std::string> kTheirOwnWay = {"stop", "db backup", "db export", "login", "logout"};

void name_leaves(const CLI::App& of, const std::string& before, std::set<std::string>& out) {
  for (const CLI::App* command : of.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string name = before + command->get_name();
    if (command->get_subcommands([](const CLI::App*) { return true; }).empty())
      out.insert(name);
    else
      name_leaves(*command, name + " ", out);
  }
}

std::map<std::string, std::vector<std::string>> all_changes() {
  auto out = kChanges;
  for (const std::string& command : kToTheUnit) out[command] = out["job " + command] = {};
  return out;
}

TEST(NextSteps, EveryCommandIsOneThatChangesSomethingOrOneThatDoesNot) {
  CLI::App app;
  CommandContext context;
  add_cell_tree(app, context);
  std::set<std::string> there, known = kAnswers;
  name_leaves(app, "", there);
  std::erase_if(there, [](const std::string& name) { return name.starts_with("sim "); });  // no command to the cell
  known.insert(kTheirOwnWay.begin(), kTheirOwnWay.end());
  for (const auto& [name, arguments] : all_changes()) known.insert(name);
  EXPECT_EQ(there, known);
}

TEST(NextSteps, AreNamedAfterWhatChangesSomething) {
  std::optional<daemon::TaskReporter> work;
  ApiServer server({}, {}, [](Router& router) {
    router.bind("getStatus", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json(
          {{"next_step",
            {{"step", "start"}, {"sentence", "Job 1 waits: Start."}, {"command", "veneerctl job start 1"}}}}));
    });
    for (const char* operation : {"settlePiece", "command"})
      router.bind(operation, [](const ApiRequest&, const Reply& reply) {
        reply(ApiReply::json({{"state", "Idle"}, {"reason", "Ready."}}));
      });
  });
  const std::string picture = (server.folder() / "picture.png").string(),
                    drawing = (server.folder() / "a.svg").string();
  std::ofstream(picture) << "a picture";
  std::ofstream(drawing) << R"(<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="20mm" viewBox="0 0 20 20">)"
                            R"(<path d="M1 1 L9 1" stroke="#f00" fill="none"/></svg>)";
  const std::string password = (server.folder() / "password").string();
  std::ofstream(password) << "a long password\n";
  const auto say = [&](const std::string& name, const std::vector<std::string>& arguments) {
    std::string line = "exec '" VENEERCTL "' --socket '" + server.socket() + "' " + name, from = "/dev/null";
    for (const std::string& one : arguments)
      if (one == "<")
        from = password;
      else
        line += " '" + (one == "PICTURE" ? picture : one == "DRAWING" ? drawing : one) + "'";
    return tests::run_program({"/bin/sh", "-c", line + " <'" + from + "' 2>&1"});
  };
  // What is cancelled, revoked and removed.
  server.on_reactor([&] { work = server.tasks().start("plan", "matching patches"); });
  ASSERT_EQ(say("user add", {"<", "bob"}).status, 0);
  ASSERT_EQ(say("token new", {"bob", "press"}).status, 0);
  for (const auto& [name, arguments] : all_changes()) {
    const auto said = say(name, arguments);
    EXPECT_EQ(said.status, 0) << name << ": " << said.output;
    EXPECT_THAT(said.output, HasSubstr("veneerctl ")) << name;
  }
}

}  // namespace
}  // namespace veneer::cli
