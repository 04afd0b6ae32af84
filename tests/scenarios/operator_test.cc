// A day at the machine: what operators do between Start and the last piece, and who may do it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>

#include "tests/scenarios/operated_cell.h"
#include "tests/support/http_probe.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class Operator : public OperatedCell {};
// Slow enough that most of the job is still to come when the operator, or the cable, has acted.
class OperatorInTheMiddle : public Operator {
 protected:
  double time_scale() const override { return 10; }
};

TEST_F(OperatorInTheMiddle, StopAfterAPieceAndTheRestAnotherDayInANewPose) {
  cut_some();
  ASSERT_EQ(post("/commands/stop-after-piece"), "");
  const json stopped = wait_state("Stopped");
  EXPECT_EQ(stopped["job"]["suspect"], 0);
  EXPECT_LT(stopped["job"]["cut"].get<int>(), 16);
  lift();
  ASSERT_EQ(cell_->stop_daemon(), 0);
  ASSERT_TRUE(cell_->start_daemon().ok());
  EXPECT_EQ(get("/status")["state"], "Stopped");
  begin();
  ASSERT_EQ(post("/commands/unsuspend"), "");
  EXPECT_EQ(wait_state("Complete")["job"]["cut"], 16);
  lift();
  EXPECT_THAT(red(), IsEmpty()) << story_->report().dump(2);
}

TEST_F(OperatorInTheMiddle, AfterALostLinkTheRemainingPiecesAreCutFromANewPose) {
  cut_some();
  ASSERT_TRUE(cell_->twin({{"cmd", "fault"}, {"name", "laser_unplug"}}).ok());
  const json aborted = wait_state("Aborted");
  const int cut = aborted["job"]["cut"], suspect = aborted["job"]["suspect"];
  EXPECT_LE(suspect, 1);
  EXPECT_THAT(post("/commands/unhold"), HasSubstr("not possible"));
  ASSERT_TRUE(cell_->twin({{"cmd", "fault"}, {"name", "laser_replug"}}).ok());
  EXPECT_EQ(get("/status")["state"], "Aborted");  // nothing comes back by itself
  wait_proven();
  lift();
  ASSERT_EQ(post("/commands/clear"), "");
  begin();
  ASSERT_EQ(post("/commands/unsuspend"), "");
  wait([](const json& s) { return s["state"] == "Complete" || s["state"] == "Stopped"; });
  const json job = get(fmt::format("/jobs/{}", kJob));
  EXPECT_EQ(job["cut"], 16 - suspect);
  EXPECT_EQ(job["suspect"], suspect);
  EXPECT_GE(cut, 3);
  lift();
  EXPECT_THAT(red(), Not(Contains(HasSubstr("ledger_matches_burn"))));
  if (suspect == 0) return;
  // A person looked at it.
  std::string mark;
  const json pieces = get(fmt::format("/jobs/{}/pieces", kJob));
  for (const auto& piece : pieces["pieces"])
    if (piece["state"] == "suspect") mark = piece["mark"];
  EXPECT_THAT(post(fmt::format("/jobs/{}/pieces/{}/settle", kJob, mark), {{"verdict", "lovely"}}), HasSubstr("scrap"));
  EXPECT_EQ(post(fmt::format("/jobs/{}/pieces/{}/settle", kJob, mark), {{"verdict", "scrap"}}), "");
  EXPECT_EQ(get(fmt::format("/jobs/{}", kJob))["state"], "incomplete");
  EXPECT_EQ(wait([](const json& s) { return s["job"]["suspect"] == 0; })["job"]["pieces"], 16) << "the status knows";
}

TEST_F(Operator, PiecesThatAreNotThroughAreCutAgainAndBookedOnce) {
  begin();
  ASSERT_EQ(post("/commands/unsuspend"), "");
  const json complete = wait_state("Complete");
  EXPECT_EQ(complete["recut"]["pieces"], 16);
  const json ledger = get(fmt::format("/panels/{}/ledger", kPanel));
  // Sixteen squares of 12 mm.
  const json before = burnt();
  EXPECT_GE(before["through_mm"].get<double>(), 16 * 48.0);
  ASSERT_EQ(post(fmt::format("/jobs/{}/recut", kJob), {{"pieces", {"A1-1", "A3-2"}}}), "");
  wait_state("Complete");
  const double twice = before["through_mm"].get<double>() + 2 * 48.0;
  EXPECT_GE(burnt()["through_mm"].get<double>(), twice);
  EXPECT_EQ(get(fmt::format("/panels/{}/ledger", kPanel)), ledger);
  EXPECT_EQ(get("/status")["job"]["cut"], 16);
  // After a Reset as well: the machine finds its home again, and the panel was not touched.
  ASSERT_EQ(post("/commands/reset"), "");
  const json idle = wait_state("Idle");
  EXPECT_EQ(idle["recut"], json({{"job", kJob}, {"panel", kPanel}, {"pieces", 16}}));
  ASSERT_EQ(post(fmt::format("/jobs/{}/recut", kJob), {{"pieces", {"A2-2"}}}), "");
  wait_state("Idle");
  const json after = burnt();
  EXPECT_GE(after["through_mm"].get<double>(), twice + 48.0);
  EXPECT_EQ(after["engraved_mm"], before["engraved_mm"]);
  // Once it has been touched, the same cuts are not burnt again.
  lift();
  EXPECT_NE(post(fmt::format("/jobs/{}/recut", kJob), {{"pieces", {"A1-1"}}}), "");
  lay();
  EXPECT_THAT(post(fmt::format("/jobs/{}/recut", kJob), {{"pieces", {"A1-1"}}}), HasSubstr("moved by"));
  EXPECT_EQ(burnt(), after);
  lift();
  EXPECT_THAT(red(), IsEmpty()) << story_->report().dump(2);
}

// Nobody opened a lid, and the job is too small for a look on its way: the one before its end sees the bare bed.
TEST_F(OperatorInTheMiddle, APanelThatIsLiftedInMidCutLeavesNoPieceBookedAsCutThatIsNot) {
  cut_some();
  lift();
  const json held = wait_state("Held");
  EXPECT_THAT(held["reason"].get<std::string>(), HasSubstr("perhaps into the bare bed"));
  EXPECT_EQ(held["job"]["cut"], 0);
  EXPECT_EQ(held["job"]["suspect"], 16);
  ASSERT_EQ(post("/commands/stop"), "");
  const json stopped = wait_state("Stopped");
  EXPECT_THAT(stopped["next"].get<std::string>(), HasSubstr("16 are suspect: look at the suspect pieces"));
  const json job = get(fmt::format("/jobs/{}", kJob));
  EXPECT_EQ(job["cut"], 0);
  EXPECT_EQ(job["state"], "stopped");
}

// It fell into the exhaust. The panel has been scanned since: where its pieces were, it has holes.
TEST_F(Operator, ALostPieceIsMadeAgainFromWhatIsLeft) {
  begin();
  ASSERT_EQ(post("/commands/unsuspend"), "");
  wait_state("Complete");
  lift();
  ASSERT_TRUE(story_->reconcile(kJob).ok());
  const std::string job = fmt::format("/jobs/{}", kJob);
  const auto piece = [&](const std::string& mark) {
    const json reply = get(job + "/pieces");
    for (const auto& one : reply["pieces"])
      if (one["mark"] == mark) return one;
    return json();
  };
  const json before = piece("A2-3"), neighbour = piece("A2-2");
  const auto good = cell_->api().post_and_wait(job + "/redo", {{"pieces", {"A2-3"}}});
  ASSERT_FALSE(good.ok()) << "nobody said that it is lost";
  EXPECT_THAT(good.error().message, HasSubstr("--lost"));
  const auto redone = cell_->api().post_and_wait(job + "/redo", {{"pieces", {"A2-3"}}, {"lost", true}});
  ASSERT_TRUE(redone.ok()) << redone.error().message;
  ASSERT_THAT((*redone)["redone"], SizeIs(1));
  EXPECT_GE((*redone)["redone"][0]["cost"].get<double>(), (*redone)["redone"][0]["cost_before"].get<double>());
  const json after = piece("A2-3");
  EXPECT_EQ(after["id"], before["id"]);
  EXPECT_EQ(after["state"], "reserved");
  EXPECT_NE(after["panel_outline_mm"], before["panel_outline_mm"]);
  EXPECT_EQ(after["artwork_outline_mm"], before["artwork_outline_mm"]);
  EXPECT_EQ(piece("A2-2"), neighbour);
  EXPECT_EQ(get(job)["state"], "stopped");
  EXPECT_EQ(get(job)["cut"], 15);

  begin();
  ASSERT_EQ(post("/commands/unsuspend"), "");
  EXPECT_EQ(wait_state("Complete")["job"]["cut"], 16);
  EXPECT_EQ(get(job)["state"], "complete");
  lift();
  EXPECT_THAT(red(), IsEmpty()) << story_->report().dump(2);
}

// Between the nodes of the toolpath's grid, as the console goes.
std::pair<double, double> in_picture(const json& grid, const json& place_mm) {
  std::size_t node[2] = {};
  double part[2] = {};
  for (const std::size_t axis : {0U, 1U}) {
    const std::size_t steps = grid[axis == 0 ? "columns" : "rows"].get<std::size_t>() - 1;
    const double low = grid["min_mm"][axis], high = grid["max_mm"][axis];
    const double at = (place_mm[axis].get<double>() - low) / (high - low) * static_cast<double>(steps);
    node[axis] = std::min(static_cast<std::size_t>(std::max(at, 0.0)), steps - 1);
    part[axis] = at - static_cast<double>(node[axis]);
  }
  const std::size_t columns = grid["columns"];
  double out[2] = {};
  for (const std::size_t i : {0U, 1U})
    for (const std::size_t j : {0U, 1U})
      for (const std::size_t axis : {0U, 1U})
        out[axis] += (i == 1 ? part[0] : 1 - part[0]) * (j == 1 ? part[1] : 1 - part[1]) *
                     grid["points"][(node[1] + j) * columns + node[0] + i][axis].get<double>();
  return {out[0], out[1]};
}

TEST_F(Operator, TheFrameMovesTheHeadAndBurnsNothing) {
  begin();
  const json drawn = get("/bed/toolpath");
  ASSERT_THAT(drawn["pieces"], SizeIs(16));
  for (const auto& piece : drawn["pieces"])
    for (const auto& line : piece["lines"])
      for (const auto& p : line["points"]) {
        EXPECT_TRUE(p[0] >= 0.0 && p[0] <= 1.0 && p[1] >= 0.0 && p[1] <= 1.0) << p;
      }
  EXPECT_GE(drawn["frame"].size(), 4U);
  EXPECT_GT(get("/status")["load"]["estimate_s"].get<double>(), 0);
  const json before = burnt(), place = get("/status")["laser"]["position_mm"];
  ASSERT_EQ(post("/commands/frame"), "");
  EXPECT_EQ(burnt(), before);
  const json status = wait([&](const json& s) { return s["laser"]["position_mm"] != place; });
  EXPECT_EQ(status["state"], "Suspended");
  // The head has come round to where the frame begins: the picture shows it there.
  const json& path = drawn["frame"];
  wait([&](const json& s) {
    const auto [x, y] = in_picture(drawn["machine"], s["laser"]["position_mm"]);
    return std::abs(x - path.back()[0].get<double>()) < 5e-4 && std::abs(y - path.back()[1].get<double>()) < 5e-4;
  });
  EXPECT_THAT(post("/commands/frame", {{"power", 0.5}}), HasSubstr("at most"));
  wait_found();
  ASSERT_EQ(post("/commands/unsuspend"), "");
  wait_state("Complete");
}

// The camera looks before the laser is homed, and that takes its time: here as long as the twin stands still.
TEST_F(Operator, ACalibrationOfTheLaserThatIsCancelledWhileTheCameraLooksHomesNothing) {
  constexpr double kWidth = 490, kHeight = 290;
  ASSERT_TRUE(cell_->twin({{"cmd", "new-board"}, {"name", "bare"}, {"width_mm", kWidth}, {"height_mm", kHeight}}).ok());
  ASSERT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "bare"}, {"on", "bed"}, {"face", "show"}}).ok());
  ASSERT_EQ(get("/status")["state"], "Stopped");
  const auto calibrate = [&] {
    const auto begun = cell_->api().post("/calibration/laser",
                                         {{"board_width_mm", kWidth},
                                          {"board_height_mm", kHeight},
                                          {"confirmed", {"board on the bed", "board not seen", "scrap on the bed"}}});
    EXPECT_TRUE(begun.ok()) << begun.error().message;
    return begun ? fmt::format("/tasks/{}", begun->value("task", 0)) : std::string();
  };
  ASSERT_EQ(::kill(cell_->twin_pid(), SIGSTOP), 0);
  const std::string cancelled = calibrate();
  EXPECT_TRUE(cell_->api().request("DELETE", cancelled, "", "").ok());
  ASSERT_EQ(::kill(cell_->twin_pid(), SIGCONT), 0);
  wait([&](const json&) { return get(cancelled)["state"] != "running"; });
  EXPECT_EQ(get(cancelled)["state"], "cancelled") << get(cancelled);
  EXPECT_EQ(get("/status")["state"], "Stopped");
  EXPECT_FALSE(get("/status")["laser"]["connected"].get<bool>()) << "no byte went to it";

  // The same order, not cancelled, is not refused.
  calibrate();
  wait([](const json& s) { return s["state"] != "Stopped"; });
  EXPECT_EQ(post("/stop"), "");
}

// As every loading goes on a machine with a lid switch.
TEST_F(Operator, ThePanelIsLaidThroughTheLid) {
  ASSERT_EQ(post("/commands/reset"), "");
  ASSERT_EQ(post(fmt::format("/jobs/{}/start", kJob)), "");
  lid(true);
  lay();
  const json open = wait([](const json& s) {
    return s["load"].is_object() && s["load"].value("sentence", "").find("lid is open") != std::string::npos;
  });
  EXPECT_FALSE(open["load"]["found"].get<bool>());
  EXPECT_THAT(post("/commands/unsuspend"), HasSubstr("lid is open"));
  EXPECT_EQ(get("/status")["state"], "Suspended");
  lid(false);
  wait_found();
  const json closed = get("/status");
  ASSERT_EQ(closed["laser"]["state"], "Door:0") << "it waits for what is started next";
  int links = 0;
  for (const json& link : closed["interlocks"]) {
    if (link["name"] != "lid" && link["name"] != "machine") continue;
    ++links;
    EXPECT_EQ(link["state"], "good") << link;
  }
  EXPECT_EQ(links, 2);
  ASSERT_EQ(post("/commands/unsuspend"), "");
  EXPECT_EQ(wait([](const json& s) { return s["state"] == "Complete" || s["state"] == "Aborted"; })["state"],
            "Complete");
}

TEST_F(Operator, ABrowserMayLookAndStopAndOperatesOnlyWithALinkMadeOnTheMachine) {
  const auto link = cell_->api().post("/console-links");
  ASSERT_TRUE(link.ok()) << link.error().message;
  const std::string url = (*link)["url"];
  const auto slash = url.find("/console");
  const std::string host = url.substr(7, slash - 7);
  const int port = std::stoi(host.substr(host.find(':') + 1));
  const auto ask = [&](const std::string& line, const std::string& headers = {}, const std::string& named = {},
                       const std::string& body = {}) {
    auto probe = testing::HttpProbe::over_tcp(port);
    return probe.ask(line + " HTTP/1.1\r\nHost: " + (named.empty() ? host : named) +
                     "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body);
  };
  EXPECT_EQ(ask("GET /api/v1/status").status, 200);
  for (const char* forbidden :
       {"/api/v1/commands/reset", "/api/v1/jobs/1/start", "/api/v1/commands/unsuspend", "/api/v1/commands/frame",
        "/api/v1/jobs/1/recut", "/api/v1/jobs/1/cancel", "/api/v1/calibration/laser", "/api/v1/console-links"})
    EXPECT_EQ(ask(std::string("POST ") + forbidden).status, 403) << forbidden;
  EXPECT_EQ(ask("GET /api/v1/status", {}, "evil.example").status, 403);
  EXPECT_EQ(get("/status")["state"], "Stopped");

  EXPECT_EQ(ask("GET /console").status, 200);
  const std::string token = json{{"token", url.substr(url.find("#token=") + 7)}}.dump();
  const auto entered = ask("POST /api/v1/session", {}, {}, token);
  ASSERT_EQ(entered.status, 200) << entered.body;
  const std::string secret = json::parse(entered.body)["session"];
  const std::string session = "Authorization: Bearer " + secret + "\r\n";
  EXPECT_EQ(ask("POST /api/v1/session", {}, {}, token).status, 403);  // a link opens once
  EXPECT_EQ(ask("POST /api/v1/commands/reset", "Cookie: veneer_session=" + secret + "\r\n").status, 403);
  EXPECT_EQ(ask("POST /api/v1/commands/reset", session + "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(ask("POST /api/v1/commands/reset", session + "Origin: http://" + host + "\r\n").status, 200);
  wait_state("Idle");

  EXPECT_EQ(ask("POST /api/v1/stop").status, 200);  // anybody
  wait_state("Aborted");
}

TEST_F(Operator, OverTheSocketTheGroupDecides) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  namespace fs = std::filesystem;
  const fs::path folder = cell_->api_socket().parent_path();
  ASSERT_EQ(chmod(folder.c_str(), 0755), 0);
  fs::copy_file(bin_dir() / "veneerctl", folder / "veneerctl");  // where anybody can run it
  const auto as = [&](const std::string& groups, std::vector<std::string> words) {
    std::vector<std::string> command{"/usr/bin/setpriv",
                                     "--reuid=65534",
                                     "--regid=65534",
                                     groups,
                                     (folder / "veneerctl").string(),
                                     "--socket",
                                     cell_->api_socket().string()};
    command.insert(command.end(), words.begin(), words.end());
    return run_program(command);
  };
  const std::string member = "--groups=1", stranger = "--clear-groups";
  // Without an operator group only root and the daemon's own user operate.
  EXPECT_EQ(as(member, {"status"}).status, 0);
  EXPECT_EQ(as(member, {"reset"}).status, 1);
  ASSERT_EQ(cell_->stop_daemon(), 0);
  cell_->set_operator_group("daemon");  // gid 1 on every Debian
  ASSERT_TRUE(cell_->start_daemon().ok());
  EXPECT_EQ(as(stranger, {"status"}).status, 0);
  EXPECT_EQ(as(stranger, {"reset"}).status, 1);
  EXPECT_EQ(as(member, {"status"}).status, 0);
  const Finished reset = as(member, {"reset"});
  EXPECT_EQ(reset.status, 0) << reset.output;
  EXPECT_EQ(get("/status")["state"], "Idle");
  EXPECT_EQ(as(stranger, {"stop"}).status, 0) << "anybody";
  wait_state("Aborted");
}

}  // namespace
}  // namespace veneer::tests
