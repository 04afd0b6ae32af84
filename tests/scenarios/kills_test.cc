// The daemon killed (kill -9) at any moment of a job: while it cuts, finds the panel, plans lost pieces again, or
// compares a scan with the ledger. After each: no wood that was burnt is called free or reserved, none that is there is
// called cut, and pieces and ledger say the same. `./dev soak ledger` kills it more often (VENEER_SEED,
// VENEER_DAEMON_KILLS).
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <random>

#include "tests/scenarios/operated_cell.h"
#include "tests/support/campaign_size.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using testing::number_from;

// Several cells one after the other: each has wood for some 25 kills.
class Kills : public OperatedCell, public ::testing::WithParamInterface<std::uint32_t> {
 protected:
  using Clock = std::chrono::steady_clock;
  enum What { kCutting, kLoading, kRedo, kReconcile, kWhats };

  double time_scale() const override { return 100; }

  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  std::vector<std::string> marks_in(const std::string& state) {
    std::vector<std::string> out;
    const json pieces = get(fmt::format("/jobs/{}/pieces", kJob));
    for (const auto& piece : pieces["pieces"])
      if (piece["state"] == state) out.push_back(piece["mark"]);
    return out;
  }
  void clear_bed() { static_cast<void>(cell_->twin({{"cmd", "lift"}, {"from", "bed"}})); }

  // Until the daemon is dead, or there is nothing more to wait for; then it is killed where it rests.
  void wait_for_the_end(const std::function<bool(const json&)>& done) {
    const auto end = Clock::now() + std::chrono::seconds(120);
    while (cell_->daemon_running() && Clock::now() < end) {
      const auto status = cell_->api().get("/status");
      if (status && done(*status)) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_LT(Clock::now(), end) << "neither done nor dead";
    ::kill(cell_->daemon_pid(), SIGKILL);
  }
  // Does something that may fail, since the daemon is killed meanwhile.
  void killed_during(unsigned most_ms, const std::function<void()>& something) {
    const auto after = std::chrono::milliseconds(below(most_ms));
    const std::jthread killer([pid = cell_->daemon_pid(), after] {
      std::this_thread::sleep_for(after);
      ::kill(pid, SIGKILL);
    });
    something();
    wait_for_the_end([](const json&) { return false; });
  }

  // Pieces that are missing, or else some that are cut and shall be lost.
  std::vector<std::string> to_be_made_again() {
    auto marks = marks_in("scrap");
    if (marks.empty()) marks = marks_in("cut");
    std::shuffle(marks.begin(), marks.end(), random_);
    marks.resize(std::min<std::size_t>(marks.size(), 3));
    return marks;
  }
  void redo(const std::vector<std::string>& marks) {
    static_cast<void>(
        cell_->api().post_and_wait(fmt::format("/jobs/{}/redo", kJob), {{"pieces", marks}, {"lost", true}}));
  }

  What choose() {
    // Pieces are made again unharmed, too, or there would soon be nothing to cut.
    if (marks_in("reserved").empty() && below(3) != 0) redo(to_be_made_again());
    constexpr std::array kOften = {kCutting, kCutting, kCutting, kCutting, kLoading, kRedo, kReconcile};
    const What what = kOften[below(kOften.size())];
    return what == kReconcile || !marks_in("reserved").empty() ? what : kRedo;
  }
  void live_and_die(What what) {
    switch (what) {
      case kCutting:
        begin();
        if (HasFatalFailure()) return;
        signal_at_burn(cell_->daemon_pid(), SIGKILL, 1 + below(200));
        ASSERT_EQ(post("/commands/unsuspend"), "");
        return wait_for_the_end([](const json& s) { return s["state"] == "Complete" || s["state"] == "Stopped"; });
      case kLoading:
        return killed_during(2500, [&] {
          static_cast<void>(post("/commands/reset"));
          static_cast<void>(post(fmt::format("/jobs/{}/start", kJob)));
          lay();
        });
      case kRedo:
        return killed_during(3000, [&] { redo(to_be_made_again()); });
      case kReconcile:
        return killed_during(6000, [&] { static_cast<void>(story_->reconcile(kJob)); });
      case kWhats:
        return;
    }
  }

  // Every piece's newest wood is in the piece's state.
  void expect_ledger_says_what_the_job_says() {
    std::map<int, std::string> booked;
    const json ledger = get(fmt::format("/panels/{}/ledger?limit=1000", kPanel));
    for (const auto& row : ledger["allocations"])
      if (row["piece"].get<int>() != 0) booked[row["piece"].get<int>()] = row["state"];
    const json pieces = get(fmt::format("/jobs/{}/pieces", kJob));
    ASSERT_EQ(booked.size(), pieces["pieces"].size());
    for (const auto& piece : pieces["pieces"]) EXPECT_EQ(booked[piece["id"].get<int>()], piece["state"]) << piece;
  }
  void expect_true() {
    expect_ledger_says_what_the_job_says();
    const auto proven = story_->prove(bin_dir());
    ASSERT_TRUE(proven.ok()) << proven.error().message;
    EXPECT_EQ(story_->report().value("/jobs/0/ledger_matches_burn"_json_pointer, json()), true)
        << story_->report().dump(2);
  }
  // What an operator does after it: takes the panel out, settles what is in doubt.
  void get_over_it() {
    wait([](const json& s) { return s["database"]["state"] == "good"; });
    const json job = get(fmt::format("/jobs/{}", kJob));
    EXPECT_NE(job["state"], "running");
    clear_bed();
    if (get("/status")["state"] == "Aborted") {
      ASSERT_EQ(post("/commands/clear"), "");
    }
    expect_true();
    for (const auto& mark : marks_in("suspect"))
      ASSERT_EQ(post(fmt::format("/jobs/{}/pieces/{}/settle", kJob, mark), {{"verdict", "scrap"}}), "");
    EXPECT_EQ(marks_in("cutting").size(), 0U);
  }

  std::mt19937 random_{static_cast<std::uint32_t>(number_from("VENEER_SEED", 20260501)) + GetParam()};
};

TEST_P(Kills, OfTheDaemonLeaveWoodAndLedgerTrue) {
  const auto kills = number_from("VENEER_DAEMON_KILLS", 25);
  std::array<int, kWhats> often{};
  for (std::uint64_t kill = 0; kill < kills; ++kill) {
    const What what = choose();
    SCOPED_TRACE(fmt::format("kill {}, while {}", kill,
                             std::array{"cutting", "loading", "making pieces again", "reconciling"}[what]));
    ++often[what];
    live_and_die(what);
    if (HasFailure()) return;
    ASSERT_EQ(cell_->wait_daemon(), 128 + SIGKILL);
    ASSERT_TRUE(cell_->start_daemon().ok());
    get_over_it();
    if (HasFailure()) return;
  }
  std::printf(
      "%d kills while cutting, %d while a panel was looked for, %d while pieces were made again, %d while the "
      "wood was compared\n",
      often[kCutting], often[kLoading], often[kRedo], often[kReconcile]);
}

INSTANTIATE_TEST_SUITE_P(Cells, Kills, ::testing::Values(0U, 1U));

}  // namespace
}  // namespace veneer::tests
