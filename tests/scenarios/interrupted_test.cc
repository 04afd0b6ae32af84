// What breaks a job off from outside the machine: a killed daemon or guardian, a full disk. Afterwards wood, job and
// ledger say the same, piece by piece, and the rest is cut.
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "base/files.h"
#include "base/polygon_ops.h"
#include "tests/scenarios/operated_cell.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Interrupted : public OperatedCell {
 protected:
  std::map<std::string, std::string> states() {
    std::map<std::string, std::string> out;
    const json pieces = get(fmt::format("/jobs/{}/pieces", kJob));
    for (const auto& piece : pieces["pieces"]) out[piece["mark"]] = piece["state"];
    return out;
  }
  std::set<std::string> marks_in(const std::string& state) {
    std::set<std::string> out;
    for (const auto& [mark, is] : states())
      if (is == state) out.insert(mark);
    return out;
  }
  // Every piece's allocation is in the piece's state.
  void expect_ledger_says_what_the_job_says() {
    std::map<int, std::string> booked;
    const json ledger = get(fmt::format("/panels/{}/ledger", kPanel));
    for (const auto& row : ledger["allocations"]) booked[row["piece"].get<int>()] = row["state"];
    const json pieces = get(fmt::format("/jobs/{}/pieces", kJob));
    ASSERT_EQ(booked.size(), pieces["pieces"].size());
    for (const auto& piece : pieces["pieces"]) EXPECT_EQ(booked[piece["id"].get<int>()], piece["state"]) << piece;
  }
  // What the proof says against the wood, the ledger and the pieces that are out; a piece in doubt is one too few, in
  // the picture as well.
  std::vector<std::string> untrue() {
    auto figures = red();
    std::erase_if(figures, [](const std::string& f) {
      return f.find("/suspect = ") != std::string::npos || f.find("/cut = ") != std::string::npos ||
             f.find("/picture_ssim") != std::string::npos;
    });
    return figures;
  }
  // The rest of the job in a new pose; nothing that was touched before is on its way again.
  void cut_the_rest(const std::set<std::string>& untouched) {
    begin();
    std::set<std::string> drawn;
    const json toolpath = get("/bed/toolpath");
    for (const auto& piece : toolpath["pieces"]) drawn.insert(piece["mark"].get<std::string>());
    EXPECT_EQ(drawn, untouched);
    ASSERT_EQ(post("/commands/unsuspend"), "");
    wait([](const json& s) { return s["state"] == "Complete" || s["state"] == "Stopped"; });
    lift();
  }
  Result<json> new_job(const std::string& query) {
    auto started = cell_->api().request("POST", "/jobs?name=again&" + query, target(), "application/octet-stream");
    if (!started) return started;
    return cell_->api().wait_task((*started)["task"]);
  }
};

TEST_F(Interrupted, AKilledDaemonLeavesWoodJobAndLedgerTrueByName) {
  int led = 0;
  const json planned = get(fmt::format("/jobs/{}/pieces", kJob));
  for (const auto& piece : planned["pieces"]) led += piece.contains("lead_in_mm") ? 1 : 0;
  EXPECT_GE(led, 12) << "the cuts begin in waste";
  begin();
  signal_at_burn(cell_->daemon_pid(), SIGKILL, 240);
  ASSERT_EQ(post("/commands/unsuspend"), "");
  ASSERT_EQ(cell_->wait_daemon(), 128 + SIGKILL);
  ASSERT_TRUE(cell_->start_daemon().ok());
  const json found = get("/status");
  EXPECT_EQ(found["state"], "Aborted");
  EXPECT_THAT(found.value("reason", ""), HasSubstr("stopped in the middle of job 1, and one piece is suspect"));
  const auto cut = marks_in("cut"), suspect = marks_in("suspect"), rest = marks_in("reserved");
  EXPECT_GE(cut.size(), 3U);
  EXPECT_EQ(suspect.size(), 1U);
  EXPECT_EQ(cut.size() + suspect.size() + rest.size(), 16U);
  const std::string log = read_whole(cell_->daemon_log()).value_or("no log");
  EXPECT_THAT(log, HasSubstr(fmt::format("piece {} of job 1 on panel {} was being cut and is suspect: look at it, then "
                                         "veneerctl job settle 1 {}",
                                         *suspect.begin(), kPanel, *suspect.begin())));
  EXPECT_THAT(log, HasSubstr("job 1 was running when this program ended last and is aborted; veneerctl job start 1"));
  expect_ledger_says_what_the_job_says();
  wait_proven();
  lift();
  EXPECT_THAT(untrue(), Not(Contains(HasSubstr("ledger_matches_burn")))) << story_->report().dump(2);

  // An end in order forgets neither that Clear is owed nor the piece that somebody has to look at.
  ASSERT_EQ(cell_->stop_daemon(), 0);
  ASSERT_TRUE(cell_->start_daemon().ok());
  EXPECT_EQ(get("/status")["state"], "Aborted");
  EXPECT_THAT(get("/status").value("reason", ""), HasSubstr("nobody has cleared that since"));
  ASSERT_EQ(post("/commands/clear"), "");
  ASSERT_EQ(cell_->stop_daemon(), 0);
  ASSERT_TRUE(cell_->start_daemon().ok());
  EXPECT_EQ(wait([](const json& s) { return s["next_step"]["step"] == "settle"; })["state"], "Stopped");
  cut_the_rest(rest);
  EXPECT_EQ(marks_in("suspect"), suspect);
  EXPECT_EQ(marks_in("cut").size(), 16 - suspect.size());
  expect_ledger_says_what_the_job_says();
  EXPECT_THAT(untrue(), IsEmpty()) << story_->report().dump(2);

  // Who brought the cell so far is in the log that is kept, and what came of what he asked for.
  std::set<std::string> noted;
  for (json page = get("/audit?limit=100"); !page["entries"].empty();
       page = get(fmt::format("/audit?limit=100&cursor={}", page["entries"].back()["id"].get<int>())))
    for (const auto& row : page["entries"]) noted.insert(row["what"].get<std::string>());
  for (const char* what : {"api.scan", "api.scan.done", "api.calibrate", "api.calibrate.done", "api.newJob",
                           "api.newJob.done", "api.startJob", "api.command"})
    EXPECT_THAT(noted, Contains(what));
}

TEST_F(Interrupted, AFullDiskEndsTheJobInOneSentenceAndForgetsNothing) {
  begin();
  fill_disk_at_burn(240);  // three of sixteen pieces are cut, and the fourth burns
  ASSERT_EQ(post("/commands/unsuspend"), "");
  const json aborted = wait([](const json& s) { return s["state"] == "Aborted" || s["state"] == "Complete"; });
  ASSERT_EQ(aborted["state"], "Aborted");
  EXPECT_THAT(aborted.value("reason", ""), HasSubstr("make room on the disk"));
  EXPECT_FALSE(aborted["laser"]["beam_on"].get<bool>());
  EXPECT_THAT(post("/commands/clear"), HasSubstr("make room on the disk"));
  EXPECT_EQ(get("/status")["state"], "Aborted");
  cell_->set_disk_full(false);
  ASSERT_EQ(post("/commands/clear"), "");
  wait_proven();
  lift();
  EXPECT_THAT(marks_in("suspect"), IsEmpty()) << "what was burnt was proven, and is booked after all";
  const auto cut = marks_in("cut");
  EXPECT_GE(cut.size(), 3U);
  expect_ledger_says_what_the_job_says();
  cut_the_rest(marks_in("reserved"));
  EXPECT_EQ(marks_in("cut").size(), 16U);
  EXPECT_THAT(red(), IsEmpty()) << story_->report().dump(2);
}

TEST_F(Interrupted, AJobThatTheDiskDoesNotTakeReservesNothing) {
  std::filesystem::remove_all(cell_->data_dir() / "index");  // so that the planner has something to keep, too
  const json before = get(fmt::format("/panels/{}/ledger", kPanel));
  cell_->set_disk_full(true);
  const auto refused = new_job("size_mm=24&patch_mm=12");
  ASSERT_FALSE(refused.ok()) << refused->dump();
  EXPECT_THAT(refused.error().message, HasSubstr("room on the disk"));
  EXPECT_EQ(get("/jobs")["jobs"].size(), 1U);
  EXPECT_EQ(get(fmt::format("/panels/{}/ledger", kPanel)), before);
  cell_->set_disk_full(false);
  const auto taken = new_job("size_mm=24&patch_mm=12");
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(get("/jobs")["jobs"].size(), 2U);
}

// A guardian of its own, as under systemd: the daemon does not start another one.
class WatchedFromOutside : public OperatedCell {
 protected:
  void SetUp() override {
    guard();
    OperatedCell::SetUp();
  }
  SimulatedCellOptions options() const override {
    SimulatedCellOptions out = OperatedCell::options();
    out.guardian = socket();
    return out;
  }
  std::string socket() const { return folder_ / "guardian.sock"; }
  void guard() {
    auto guardian = ChildProcess::start(
        {(bin_dir() / "veneer-guardian").string(), "--record", folder_ / "guarded", "--listen", socket()},
        folder_ / "log");
    ASSERT_TRUE(guardian.ok()) << guardian.error().message;
    guardian_.emplace(std::move(*guardian));
  }

  testing::TempDirectory folder_;
  std::optional<ChildProcess> guardian_;
};

// The piece that burns is burnt to its end, for nothing is wrong with it; the next one waits for somebody who would
// darken the machine.
TEST_F(WatchedFromOutside, AGuardianThatDiesInAPieceHoldsTheJobBeforeTheNextOne) {
  begin();
  signal_at_burn(guardian_->pid(), SIGKILL, 240);
  ASSERT_EQ(post("/commands/unsuspend"), "");
  const json held = wait([](const json& s) { return s["state"] == "Held" || s["state"] == "Complete"; });
  ASSERT_EQ(held["state"], "Held") << held["reason"];
  EXPECT_THAT(held["reason"].get<std::string>(), HasSubstr("veneer-guardian.service"));
  const json pieces = get(fmt::format("/jobs/{}/pieces", kJob))["pieces"];
  const auto cut = std::ranges::count_if(pieces, [](const json& piece) { return piece["state"] == "cut"; });
  EXPECT_GT(cut, 0);
  EXPECT_LT(cut, std::ssize(pieces));
  const json before = burnt();
  EXPECT_THAT(post("/commands/unhold"), HasSubstr("veneer-guardian.service"));
  EXPECT_EQ(get("/status")["state"], "Held");
  EXPECT_EQ(burnt(), before) << "nothing burns unwatched";
  guardian_->wait();
  guard();
  wait([](const json& s) { return s["laser"]["refusal"].is_null(); });
  ASSERT_EQ(post("/commands/unhold"), "");
  wait_state("Complete");
  lift();
  EXPECT_THAT(red(), IsEmpty());
}

}  // namespace
}  // namespace veneer::tests
