// `veneerctl plan` that is killed or interrupted: what lies there afterwards, and how the same command goes on.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/hash.h"
#include "tests/cli/plan_run.h"
#include "tests/support/program_start.h"

namespace veneer::planner {
namespace {

using ::testing::EndsWith;
using ::testing::Not;

// A command whose standard error is read write by write. The pipe between them holds one write, and until() leaves the
// one that it was waiting for in it: the command cannot come past the end of that line, however fast it is, before
// somebody reads on.
class ReadAlong {
 public:
  explicit ReadAlong(const std::string& command) {
    std::array<int, 2> ends{};
    constexpr int kOnePage = 1;  // a page, at least; with O_DIRECT each write takes one
    if (pipe2(ends.data(), O_CLOEXEC | O_DIRECT) != 0 || fcntl(ends[1], F_SETPIPE_SZ, kOnePage) < 0 ||
        pipe2(seen_.data(), O_CLOEXEC) != 0)
      throw std::runtime_error("no pipe");
    pid_ = tests::ProgramStart({"/bin/sh", "-c", "exec " + command}).run(STDOUT_FILENO, ends[1]);
    close(ends[1]);
    end_ = ends[0];
  }
  ~ReadAlong() {
    finish();
    for (const int end : seen_) close(end);
  }
  ReadAlong(const ReadAlong&) = delete;
  ReadAlong& operator=(const ReadAlong&) = delete;

  // Reads until `words` are next; false when it ended without them.
  bool until(const std::string& words) {
    for (;;) {
      const std::string next = look();
      if (next.empty()) return false;
      if (next.find(words) != std::string::npos) return true;
      read_some();
    }
  }
  void interrupt() const { kill(pid_, SIGINT); }
  Outcome finish() {
    while (read_some()) continue;
    if (end_ >= 0) {
      close(std::exchange(end_, -1));
      waitpid(pid_, &status_, 0);
    }
    return {WIFEXITED(status_) ? WEXITSTATUS(status_) : -1, text_};
  }

 private:
  using Write = std::array<char, PIPE_BUF>;
  // The write that is next, which stays where it is; "": there are no more.
  std::string look() {
    Write some{};
    if (tee(end_, seen_[1], some.size(), 0) <= 0) return "";
    return {some.data(), static_cast<std::size_t>(std::max<ssize_t>(0, read(seen_[0], some.data(), some.size())))};
  }
  bool read_some() {
    Write some{};
    const ssize_t count = end_ < 0 ? 0 : read(end_, some.data(), some.size());
    if (count > 0) text_.append(some.data(), static_cast<std::size_t>(count));
    return count > 0;
  }

  pid_t pid_ = 0;
  int end_ = -1, status_ = 0;
  std::array<int, 2> seen_{-1, -1};
  std::string text_;
};

class PlanStops : public PlanRun {};

TEST_F(PlanStops, GoesOnAfterItWasKilled) {
  ASSERT_EQ(plan(usual()).status, 0);
  const std::string whole = text("out/plan.json"), preview = text("out/preview.png");
  EXPECT_FALSE(fs::exists(path("out/plan.journal")));
  fs::remove_all(path("out"));
  // Killed by the limit on the size of files: its journal is the first to reach it.
  const std::string command =
      "ulimit -c 0; ulimit -f 1; " + std::string(VENEERCTL) + " plan " + usual() + " 2>" + path("stderr");
  EXPECT_NE(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe): a test has one thread here
  EXPECT_TRUE(fs::exists(path("out/plan.journal")));
  EXPECT_FALSE(fs::exists(path("out/plan.json")));
  const Outcome outcome = plan(usual());
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.errors, HasSubstr("going on where an earlier run stopped"));
  EXPECT_EQ(text("out/plan.json"), whole);
  EXPECT_EQ(text("out/preview.png"), preview);
  EXPECT_FALSE(fs::exists(path("out/plan.journal")));
}

// A run with other options that is killed while it writes its plan leaves the one that is there, and its report.
TEST_F(PlanStops, LeavesThePlanThatIsThereWhenItIsKilledWhileItWrites) {
  ASSERT_EQ(plan(usual()).status, 0);
  const std::string before = text("out/plan.json"), report = text("out/report.json");
  EXPECT_EQ(json("out/report.json")["plan_sha256"], sha256_hex(std::as_bytes(std::span(before))));
  constexpr std::size_t kUnit = 512;  // of the limit; a journal takes a tenth of a plan
  const std::string command = fmt::format("ulimit -c 0; ulimit -f {}; {} plan {} --seed 2 2>{}",
                                          before.size() / 3 / kUnit, VENEERCTL, usual(), path("stderr"));
  EXPECT_NE(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe): a test has one thread here
  EXPECT_THAT(text("stderr"), HasSubstr("placed 15 of 15 pieces"));
  EXPECT_TRUE(text("out/plan.json") == before);
  EXPECT_TRUE(text("out/report.json") == report);
}

TEST_F(PlanStops, GoesOnAfterItWasInterrupted) {
  const std::string many = replaced("--size-mm 21 --patch-mm 7", "--size-mm 35 --patch-mm 3.5") + " --threads 1";
  ReadAlong command(std::string(VENEERCTL) + " plan " + many);
  ASSERT_TRUE(command.until("placing pieces: "));
  command.interrupt();
  const Outcome stopped = command.finish();
  EXPECT_EQ(stopped.status, 1) << stopped.errors;
  EXPECT_THAT(stopped.errors,
              EndsWith("veneerctl: planning was cancelled: the same command goes on where it stopped\n"));
  EXPECT_FALSE(fs::exists(path("out/plan.json")));
  ASSERT_TRUE(fs::exists(path("out/plan.journal")));

  const Outcome gone_on = plan(many);
  ASSERT_EQ(gone_on.status, 0) << gone_on.errors;
  EXPECT_THAT(gone_on.errors, HasSubstr("going on where an earlier run stopped"));
  EXPECT_FALSE(fs::exists(path("out/plan.journal")));
  const std::string bytes = text("out/plan.json"), preview = text("out/preview.png");
  fs::remove_all(path("out"));
  ASSERT_EQ(plan(many).status, 0);
  EXPECT_EQ(text("out/plan.json"), bytes);
  EXPECT_EQ(text("out/preview.png"), preview);
}

// Every run goes on where the one before stopped, whichever of them is asked for the best so far; the last gives the
// plan of an unbroken run.
TEST_F(PlanStops, AGlobalOptimisationThatIsInterruptedGivesTheBestSoFarWhereThatIsAskedFor) {
  const std::string many = replaced("--size-mm 21 --patch-mm 7", "--size-mm 28 --patch-mm 3.5") +
                           " --threads 1 --optimize global --fine-rotation";
  ReadAlong unasked(std::string(VENEERCTL) + " plan " + many);
  ASSERT_TRUE(unasked.until("optimising: "));
  unasked.interrupt();
  const Outcome none = unasked.finish();
  EXPECT_EQ(none.status, 1) << none.errors;
  EXPECT_THAT(none.errors, EndsWith("veneerctl: planning was cancelled: the same command goes on where it stopped\n"));
  EXPECT_FALSE(fs::exists(path("out/plan.json")));

  ReadAlong command(std::string(VENEERCTL) + " plan " + many + " --best-so-far");
  ASSERT_TRUE(command.until("optimising: "));
  command.interrupt();
  const Outcome stopped = command.finish();
  ASSERT_EQ(stopped.status, 0) << stopped.errors;
  EXPECT_THAT(stopped.errors, HasSubstr("going on where an earlier run stopped"));
  EXPECT_THAT(stopped.errors, HasSubstr(", stopped after "));
  EXPECT_THAT(stopped.errors,
              EndsWith("veneerctl: this is the best plan so far, not the whole: the same command goes on "
                       "from there\n"));
  EXPECT_TRUE(fs::exists(path("out/plan.journal")));
  const auto report = json("out/report.json");
  EXPECT_EQ(report["global"]["stopped"], true);
  EXPECT_LE(report["global"]["cost"], report["global"]["greedy_cost"]);
  EXPECT_EQ(report["unfilled"], 0);
  EXPECT_EQ(json("out/plan.json")["pieces"].size(), 8U * 12U);
  EXPECT_TRUE(fs::exists(path("out/preview.png")));
  EXPECT_EQ(report["fine_rotation"]["stopped"], true);

  // Stopped before it is as far, a run leaves that plan as it is.
  const std::string best = text("out/plan.json"), journal = text("out/plan.journal");
  ReadAlong early(std::string(VENEERCTL) + " plan " + many + " --best-so-far");
  ASSERT_TRUE(early.until("placing pieces: "));
  early.interrupt();
  if (early.finish().status == 0)  // it was as far by then
    EXPECT_GE(json("out/report.json")["global"]["iterations"], report["global"]["iterations"]);
  else
    EXPECT_EQ(text("out/plan.json"), best);
  EXPECT_TRUE(text("out/plan.journal").starts_with(journal));

  const Outcome gone_on = plan(many + " --best-so-far");
  ASSERT_EQ(gone_on.status, 0) << gone_on.errors;
  EXPECT_THAT(gone_on.errors, HasSubstr("going on where an earlier run stopped"));
  EXPECT_THAT(gone_on.errors, Not(HasSubstr("best plan so far")));
  EXPECT_FALSE(fs::exists(path("out/plan.journal")));
  const std::string bytes = text("out/plan.json");
  fs::remove_all(path("out"));
  ASSERT_EQ(plan(many).status, 0);
  EXPECT_EQ(text("out/plan.json"), bytes);
}

// A finished plan has no journal left, so a run anew begins at nothing: stopped early it knows less than what is there.
TEST_F(PlanStops, ARunAnewThatIsInterruptedLeavesABetterPlanOfTheSameSettings) {
  const std::string many =
      replaced("--size-mm 21 --patch-mm 7", "--size-mm 28 --patch-mm 3.5") + " --threads 1 --optimize global";
  ASSERT_EQ(plan(many).status, 0);
  const auto files = [&] {
    return std::vector{text("out/plan.json"), text("out/report.json"), text("out/preview.png"), text("out/cut-P.svg")};
  };
  const auto whole = files();
  const auto interrupted = [&](const std::string& arguments) {
    ReadAlong command(std::string(VENEERCTL) + " plan " + arguments + " --best-so-far");
    EXPECT_TRUE(command.until("optimising: "));
    command.interrupt();
    return command.finish();
  };
  const Outcome early = interrupted(many);
  EXPECT_EQ(early.status, 1) << early.errors;
  EXPECT_THAT(early.errors,
              EndsWith("veneerctl: planning was cancelled, no result was written, and " + path("out/plan.json") +
                       " stays, the whole plan of the same pictures, wood and options: the same command "
                       "goes on where it stopped\n"));
  EXPECT_TRUE(files() == whole);

  // It does go on there, and is the same plan in the end.
  const Outcome gone_on = plan(many);
  ASSERT_EQ(gone_on.status, 0) << gone_on.errors;
  EXPECT_THAT(gone_on.errors, HasSubstr("going on where an earlier run stopped"));
  EXPECT_EQ(text("out/plan.json"), whole[0]);

  // A plan of other settings is another plan.
  const std::string others = many + " --seed 2";
  const Outcome other = interrupted(others);
  ASSERT_EQ(other.status, 0) << other.errors;
  auto report = json("out/report.json");
  EXPECT_EQ(report["stopped"], true);
  EXPECT_NE(text("out/plan.json"), whole[0]);

  // What was stopped stays in its turn where it is better, and its journal is lost.
  report["global"]["cost"] = report["global"]["cost"].get<double>() / 2;
  std::ofstream(path("out/report.json")) << report;
  fs::remove(path("out/plan.journal"));
  const auto better = files();
  const Outcome worse = interrupted(others);
  EXPECT_EQ(worse.status, 1) << worse.errors;
  EXPECT_THAT(worse.errors, HasSubstr(path("out/plan.json") + " stays, a better plan of the same pictures, wood and "
                                                              "options: the same command goes on where it stopped\n"));
  EXPECT_TRUE(files() == better);

  // A report knows its own plan only. One that was changed by hand is not written over by one that was stopped.
  fs::remove(path("out/plan.journal"));
  std::ofstream(path("out/plan.json"), std::ios::app) << " ";
  const auto touched = files();
  const Outcome unknown = interrupted(others);
  EXPECT_EQ(unknown.status, 1) << unknown.errors;
  EXPECT_THAT(unknown.errors,
              HasSubstr(path("out/plan.json") + " stays: " + path("out/report.json") + " is of another plan"));
  EXPECT_TRUE(files() == touched);

  // Nothing is known of a plan without its report.
  fs::remove(path("out/report.json")), fs::remove(path("out/plan.journal"));
  EXPECT_EQ(interrupted(others).status, 0);
}

}  // namespace
}  // namespace veneer::planner
