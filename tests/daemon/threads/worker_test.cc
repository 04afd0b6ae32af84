// Work that throws costs itself, not the program that owns the laser.
#include "daemon/threads/worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <new>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include "daemon/api/tasks.h"
#include "daemon/store/database_thread.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

TEST(Worker, GoesOnAfterWorkThatRanOutOfMemory) {
  Worker worker("test");
  std::optional<Error> told;
  worker.post([] { throw std::bad_alloc(); }, [&](const Error& error) { told = error; });
  worker.post([] { throw 7; });
  EXPECT_EQ(worker.call([] { return 42; }), 42);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->code, ErrorCode::kUnavailable);
  EXPECT_THAT(told->message, HasSubstr("not enough memory"));
}

TEST(Worker, SaysWhatALibraryThrew) {
  Worker worker("test");
  std::optional<Error> told;
  worker.post([] { throw std::runtime_error("(-215) rows >= 0"); }, [&](const Error& error) { told = error; });
  worker.call([] {});
  ASSERT_TRUE(told);
  EXPECT_EQ(told->code, ErrorCode::kInternal);
  EXPECT_THAT(told->message, HasSubstr("(-215) rows >= 0"));
}

TEST(Worker, OutlivesAFailureThatCannotBeTold) {
  Worker worker("test");
  worker.post([] { throw std::bad_alloc(); }, [](const Error&) { throw std::bad_alloc(); });
  EXPECT_EQ(worker.call([] { return 1; }), 1);
}

TEST(Worker, GivesWhatACallThrewToItsCaller) {
  Worker worker("test");
  const Result<int> result = worker.call([]() -> Result<int> { throw std::bad_alloc(); });
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kUnavailable);
  EXPECT_THROW(worker.call([]() -> int { throw std::runtime_error("x"); }), std::runtime_error);
  EXPECT_EQ(worker.call([] { return 1; }), 1);
}

TEST(Worker, TakesNoMoreThanMayWait) {
  Worker worker("test");
  std::promise<void> begun, go;
  worker.post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  begun.get_future().wait();
  int done = 0;
  EXPECT_TRUE(worker.try_post({2}, [&] { ++done; }));
  EXPECT_TRUE(worker.try_post({2}, [&] { ++done; }));
  EXPECT_FALSE(worker.try_post({2}, [&] { ++done; }));
  go.set_value();
  worker.call([] {});
  EXPECT_EQ(done, 2);
}

TEST(Worker, TakesNoMoreThanItsMemoryHolds) {
  Worker worker("test");
  std::promise<void> begun, go;
  worker.post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  begun.get_future().wait();
  const WaitingRoom room{9, 100};
  EXPECT_TRUE(worker.try_post(
      room, [] {}, {}, 60));
  EXPECT_FALSE(worker.has_room(room, 41));
  EXPECT_FALSE(worker.try_post(
      room, [] {}, {}, 41));
  EXPECT_TRUE(worker.try_post(
      room, [] {}, {}, 40));
  EXPECT_TRUE(worker.try_post(room, [] {})) << "what holds nothing has room still";
  go.set_value();
  worker.call([] {});
  EXPECT_TRUE(worker.has_room(room, 100)) << "what is done waits no more";
}

TEST(Worker, TakesWorkThatGivesWayOnlyWhileItIsIdle) {
  std::promise<void> begun, go, last;
  std::promise<bool> stopped;
  Worker worker("test");
  worker.post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  EXPECT_FALSE(worker.try_post_giving_way([](const std::stop_token&) {})) << "begun or not";
  begun.get_future().wait();
  EXPECT_FALSE(worker.try_post_giving_way([](const std::stop_token&) {}));
  worker.post([&] { last.set_value(); });
  go.set_value();
  last.get_future().wait();
  while (!worker.try_post_giving_way([&](const std::stop_token& stop) { stopped.set_value(stop.stop_requested()); }))
    std::this_thread::yield();  // the last one is all but over
  EXPECT_FALSE(stopped.get_future().get());
}

TEST(Worker, WorkThatGivesWayIsToldAsSoonAsThereIsOther) {
  Worker worker("test");
  std::promise<void> begun;
  const auto until_told = [&](const std::stop_token& stop) {
    std::promise<void> told;
    const std::stop_callback when_told(stop, [&] { told.set_value(); });
    begun.set_value();
    told.get_future().wait();
  };
  ASSERT_TRUE(worker.try_post_giving_way(until_told));
  begun.get_future().wait();
  bool like_it = false;
  EXPECT_TRUE(worker.try_post_giving_way([&](const std::stop_token& stop) { like_it = stop.stop_requested(); }));
  EXPECT_EQ(worker.call([] { return 3; }), 3);
  EXPECT_TRUE(like_it) << "what waited behind it gives way as well";
}

TEST(Worker, EndsWithoutWaitingForWorkThatGivesWay) {
  std::promise<void> begun;
  Worker worker("test");
  ASSERT_TRUE(worker.try_post_giving_way([&](const std::stop_token& stop) {
    std::promise<void> told;
    const std::stop_callback when_told(stop, [&] { told.set_value(); });
    begun.set_value();
    told.get_future().wait();
  }));
  begun.get_future().wait();
}

TEST(Worker, FailsTheTaskWhoseWorkThrew) {
  boost::asio::io_context reactor;
  const SteadyClock clock;
  TaskRegistry tasks(reactor, clock, make_reactor_timer(reactor), {});
  const auto id = [&] {
    Worker worker("test");
    auto task = tasks.start("plan", "waiting");
    worker.post([task] { throw std::bad_alloc(); }, [task](const Error& error) { task.fail(error); });
    return task.id();
  }();
  reactor.run();
  const TaskView* task = tasks.find(id);
  ASSERT_NE(task, nullptr);
  EXPECT_EQ(task->state, TaskState::kFailed);
  ASSERT_TRUE(task->error);
  EXPECT_THAT(task->error->message, HasSubstr("not enough memory"));
}

TEST(Worker, AnswersAQuestionToTheDatabaseThatThrew) {
  const testing::TempDirectory folder;
  boost::asio::io_context reactor;
  auto database = DatabaseThread::open(folder / "test.db", reactor);
  ASSERT_TRUE(database.ok());
  std::optional<Error> told;
  (*database)->async([](Repositories&) -> Result<int> { throw std::bad_alloc(); },
                     [&](const Result<int>& result) { told = result.error(); });
  (*database)->call([](Repositories&) { return 0; });
  reactor.run();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->code, ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace veneer::daemon
