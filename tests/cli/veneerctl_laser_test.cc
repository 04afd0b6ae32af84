// What veneerctl asks before the beam comes on, and what it tells the daemon then.
#include <gmock/gmock.h>

#include <fstream>
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
using testing::Outcome;
using testing::veneerctl;

TEST(VeneerctlLaser, TellsWhatIsConfirmedFramedCutAgainAndSettled) {
  std::vector<std::string> asked;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"command", "recut", "settlePiece", "assemblePieces", "cancelJob", "archiveJob",
                                  "unarchiveJob", "archiveDoneJobs", "settleAsSeen", "moveJob"})
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
  EXPECT_EQ(run({"job", "settle", "3", "A1-2", "suspect"}), 0);
  EXPECT_EQ(run({"job", "settle", "3", "--as-seen"}), 0);
  EXPECT_EQ(run({"job", "settle", "3", "--as-seen", "--there", "released", "--pieces", "A1-1", "A3-12"}), 0);
  EXPECT_EQ(run({"job", "assembled", "3", "A1-1", "A3-12"}), 0);
  EXPECT_EQ(run({"job", "assembled", "3", "A1-1", "--take-back"}), 0);
  EXPECT_EQ(run({"job", "cancel", "3"}), 0);
  EXPECT_EQ(run({"job", "archive", "3", "4"}), 0);
  EXPECT_EQ(run({"job", "archive", "--all-done"}), 0);
  EXPECT_EQ(run({"job", "unarchive", "4"}), 0);
  EXPECT_EQ(run({"job", "move", "5", "--before", "3"}), 0);
  EXPECT_EQ(run({"job", "move", "5", "--last"}), 0);
  EXPECT_EQ(run({"job", "move", "5"}), 1) << "where?";
  EXPECT_EQ(run({"job", "move", "5", "--before", "3", "--last"}), 2);
  EXPECT_EQ(run({"job", "move", "5", "--before", "0"}), 2);
  EXPECT_NE(run({"job", "archive"}), 0) << "which?";
  EXPECT_NE(run({"job", "archive", "3", "--all-done"}), 0);
  EXPECT_EQ(run({"job", "settle", "3", "A1-1", "fine"}), 2);
  EXPECT_EQ(run({"job", "settle", "3", "A1-1"}), 1) << "what became of it?";
  EXPECT_EQ(run({"job", "settle", "3", "A1-1", "cut", "--as-seen"}), 2) << "one, or all?";
  EXPECT_EQ(run({"job", "settle", "3", "--as-seen", "--there", "cut"}), 2);
  EXPECT_EQ(run({"job", "settle", "3", "--there", "scrap"}), 2);
  EXPECT_EQ(run({"job", "settle", "3", "--pieces", "A1-1"}), 2);
  EXPECT_EQ(run({"job", "recut", "3"}), 2);
  EXPECT_EQ(run({"frame", "--power", "200%"}), 2);
  EXPECT_EQ(run({"frame", "--power", "1"}), 2) << "of what?";
  const std::vector<std::string> expected = {
      R"(/api/v1/commands/unsuspend {"confirmed":["exhaust","air assist"]})",
      R"(/api/v1/commands/frame {"power":0.0})",
      R"(/api/v1/commands/frame {"power":0.02})",
      R"(/api/v1/jobs/3/recut {"confirmed":["exhaust"],"pieces":["A1-1","A3-12"]})",
      R"(/api/v1/jobs/3/pieces/A1-1/settle {"verdict":"scrap"})",
      R"(/api/v1/jobs/3/pieces/A1-2/settle {"verdict":"suspect"})",
      R"(/api/v1/jobs/3/settle-as-seen {})",
      R"(/api/v1/jobs/3/settle-as-seen {"pieces":["A1-1","A3-12"],"there":"released"})",
      R"(/api/v1/jobs/3/assembled {"assembled":true,"pieces":["A1-1","A3-12"]})",
      R"(/api/v1/jobs/3/assembled {"assembled":false,"pieces":["A1-1"]})",
      R"(/api/v1/jobs/3/cancel {})",
      R"(/api/v1/jobs/3/archive {})",
      R"(/api/v1/jobs/4/archive {})",
      R"(/api/v1/jobs/archive-done {})",
      R"(/api/v1/jobs/4/unarchive {})",
      R"(/api/v1/jobs/5/move {"before":3})",
      R"(/api/v1/jobs/5/move {})"};
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

TEST(VeneerctlLaser, AScriptSaysInWordsWhatWasSeenToBeforeTheBeamComesOn) {
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

TEST(VeneerctlLaser, OverridesAreHeldAgainstWhatTheirHelpSays) {
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
