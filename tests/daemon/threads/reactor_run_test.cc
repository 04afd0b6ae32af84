// What becomes of the machine when a handler of the reactor throws.
#include "daemon/threads/reactor_run.h"

#include <gmock/gmock.h>

#include <boost/asio/post.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void throw_in(boost::asio::io_context& reactor) {
  boost::asio::post(reactor, [] { throw std::runtime_error("a bug"); });
}

TEST(ReactorRun, EndsWhenItIsStoppedAndSaysThatAllWasWell) {
  boost::asio::io_context reactor;
  boost::asio::post(reactor, [&] { reactor.stop(); });
  bool ended = false;
  EXPECT_TRUE(run_reactor(reactor, [&](const std::string&) { ended = true; }).ok());
  EXPECT_FALSE(ended);
}

TEST(ReactorRun, TheMachineIsDarkenedBeforeAnyOtherHandlerRunsAndWhatMustBeWrittenIsWritten) {
  boost::asio::io_context reactor;
  std::vector<std::string> order;
  throw_in(reactor);
  boost::asio::post(reactor, [&] { order.push_back("another handler"); });
  const Status ran = run_reactor(reactor, [&](const std::string& sentence) {
    EXPECT_THAT(sentence, AllOf(HasSubstr("a bug"), HasSubstr("beam off"), HasSubstr("Reset")));
    order.push_back("dark");
    boost::asio::post(reactor, [&] {
      order.push_back("written");
      reactor.stop();
    });
  });
  ASSERT_FALSE(ran.ok());
  EXPECT_EQ(ran.error().code, ErrorCode::kInternal);
  EXPECT_THAT(order, ElementsAre("dark", "another handler", "written"));
}

TEST(ReactorRun, FurtherErrorsDoNotKeepTheEndFromComing) {
  boost::asio::io_context reactor;
  for (int i = 0; i < 3; ++i) throw_in(reactor);
  int ends = 0;
  bool written = false;
  const Status ran = run_reactor(reactor, [&](const std::string&) {
    ++ends;
    boost::asio::post(reactor, [&] {
      written = true;
      reactor.stop();
    });
  });
  EXPECT_FALSE(ran.ok());
  EXPECT_EQ(ends, 1);
  EXPECT_TRUE(written);
}

TEST(ReactorRun, AHandlerThatThrowsForEverDoesNotKeepTheEndFromComing) {
  boost::asio::io_context reactor;
  const std::function<void()> again = [&] {
    boost::asio::post(reactor, again);
    throw std::runtime_error("again");
  };
  boost::asio::post(reactor, again);
  EXPECT_FALSE(run_reactor(reactor, [](const std::string&) {}).ok());
}

TEST(ReactorRun, WhatIsNoStdExceptionIsAnErrorToo) {
  boost::asio::io_context reactor;
  boost::asio::post(reactor, [] { throw 7; });
  const Status ran = run_reactor(reactor, [&](const std::string&) { reactor.stop(); });
  ASSERT_FALSE(ran.ok());
  EXPECT_THAT(ran.error().message, HasSubstr("unknown kind"));
}

// The unit in the middle of a cut, as main.cc ends it.
TEST_F(JobRunnerTest, AnErrorOfTheProgramInACutEndsItInOrder) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(laser_.burning());
  throw_in(io_);
  io_.restart();
  const Status ran = run_reactor(io_, [&](const std::string& sentence) {
    runner_->abort(sentence);
    EXPECT_FALSE(laser_.burning()) << "dark before anything else";
    runner_->when_written([&] { io_.stop(); });
  });
  EXPECT_FALSE(ran.ok());
  EXPECT_THAT(laser_.calls, Contains("abort"));
  EXPECT_EQ(job_state(), db::JobState::kAborted);
  EXPECT_EQ(piece_states().front(), db::PieceState::kSuspect);
  EXPECT_THAT(runner_->view().reason, HasSubstr("a bug"));
}

}  // namespace
}  // namespace veneer::daemon
