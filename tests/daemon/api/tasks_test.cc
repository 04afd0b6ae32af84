#include "daemon/api/tasks.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/api/task_routes.h"
#include "tests/support/hand_timer.h"
#include "tests/support/task_json.h"

namespace veneer::daemon {
namespace {

class Tasks : public ::testing::Test {
 protected:
  void run() {
    reactor_.restart();
    reactor_.run();
  }
  boost::asio::io_context reactor_;
  ManualClock clock_;
  std::vector<TaskView> events_;
  testing::HandTimer* timer_ = nullptr;
  std::unique_ptr<TaskRegistry> registry_ =
      std::make_unique<TaskRegistry>(reactor_, clock_, std::make_unique<testing::HandTimer>(&timer_),
                                     [this](const TaskView& task) { events_.push_back(task); });
};

TEST_F(Tasks, GoFromStartOverProgressToTheirResult) {
  const TaskReporter reporter = registry_->start("scan", "lowering the lid");
  std::thread worker([&reporter] {
    reporter.progress(0.5, "scanning");
    reporter.done({{"panel", "P-1"}});
  });
  worker.join();
  EXPECT_EQ(registry_->find(reporter.id())->state, TaskState::kRunning);  // only the reactor changes what is seen
  run();
  const TaskView* view = registry_->find(reporter.id());
  EXPECT_EQ(view->state, TaskState::kDone);
  EXPECT_EQ(view->progress, 1);
  EXPECT_EQ(testing::json_of(*view)["result"]["panel"], "P-1");
  ASSERT_EQ(events_.size(), 2U);
  EXPECT_EQ(events_[0].text, "lowering the lid");
  EXPECT_EQ(testing::json_of(events_[1])["state"], "done");
  EXPECT_EQ(events_[1].result, view->result) << "one for all who look at it";
}

TEST_F(Tasks, TheListLeavesResultsOut) {
  const TaskReporter reporter = registry_->start("plan", "matching");
  reporter.done({{"pieces", 304}});
  run();
  const TaskView& view = *registry_->find(reporter.id());
  EXPECT_TRUE(testing::json_of(view).contains("result"));
  EXPECT_FALSE(to_list_json(view).contains("result"));
  EXPECT_EQ(to_list_json(view)["state"], "done");
}

// A plan's result is megabytes, and each of the listeners would get it.
TEST_F(Tasks, AnEventSaysWhatCameOfItInShort) {
  const TaskReporter reporter = registry_->start("plan", "matching");
  EXPECT_EQ(nlohmann::json::parse(task_event(events_[0])),
            (nlohmann::json{{"type", "task"}, {"task", to_list_json(events_[0])}}));
  nlohmann::json result = {{"pieces", 304}, {"panels", {"P-0001", "P-0002"}}, {"svg", std::string(1'000'000, 'x')}};
  for (int i = 0; i < 50; ++i) result["outlines"].push_back({{"mark", "A1-1"}, {"points", {1, 2, 3}}});
  for (int i = 0; i < 200; ++i) result["text " + std::to_string(i)] = std::string(200, 'n');
  reporter.done(result);
  run();
  const std::string told = task_event(events_.back());
  EXPECT_LT(told.size(), 4500U);
  const nlohmann::json task = nlohmann::json::parse(told)["task"];
  EXPECT_EQ(task["state"], "done");
  EXPECT_EQ(task["id"], reporter.id());
  EXPECT_EQ(task["summary"]["panels"], (nlohmann::json{"P-0001", "P-0002"}));
  EXPECT_FALSE(task["summary"].contains("outlines"));
  EXPECT_FALSE(task["summary"].contains("svg"));
  EXPECT_FALSE(task.contains("result"));
}

// A worker may say something else with each line: no reason to write to every client each time.
TEST_F(Tasks, AFloodOfTextsIsOneEventPerIntervalAndTheLastIsTold) {
  const TaskReporter reporter = registry_->start("plan", "matching");
  const TaskReporter other = registry_->start("scan", "lowering the lid");
  for (int i = 0; i < 100; ++i) {
    reporter.progress(0, "matching " + std::to_string(i));
    run();
  }
  ASSERT_EQ(events_.size(), 2U);  // the two starts
  EXPECT_EQ(timer_->wait, TaskRegistry::kEventInterval);
  clock_.advance(TaskRegistry::kEventInterval / 2);
  other.progress(0.5, "scanning");
  run();
  clock_.advance(TaskRegistry::kEventInterval / 2);
  timer_->fire();
  ASSERT_EQ(events_.size(), 4U);
  EXPECT_EQ(events_[2].text, "matching 99");
  EXPECT_EQ(events_[3].text, "scanning");
  EXPECT_FALSE(timer_->pending);
  reporter.progress(0.1, "matching 100");
  run();
  reporter.done({});
  run();
  timer_->fire();
  EXPECT_EQ(events_.size(), 5U);  // the end says it all
}

TEST_F(Tasks, AFloodOfProgressIsOneEventPerInterval) {
  const TaskReporter reporter = registry_->start("plan", "matching");
  for (int i = 0; i < 100'000; ++i) reporter.progress(i / 1e5, "matching");
  EXPECT_LE(reactor_.poll(), 1U);
  for (int i = 0; i < 10; ++i) {
    reporter.progress(1, "matching");
    run();
  }
  EXPECT_EQ(events_.size(), 1U);
  clock_.advance(TaskRegistry::kEventInterval);
  reporter.progress(1, "matching");
  run();
  EXPECT_EQ(events_.size(), 2U);
  reporter.progress(1, "refining");
  run();
  EXPECT_EQ(events_.size(), 2U);
}

TEST_F(Tasks, ProgressNeverFallsAndStaysWithinBounds) {
  const TaskReporter reporter = registry_->start("plan", "");
  for (const auto& [said, seen] : {std::pair(0.6, 0.6), {0.2, 0.6}, {-1.0, 0.6}, {7.0, 1.0}}) {
    reporter.progress(said, "");
    run();
    EXPECT_EQ(registry_->find(reporter.id())->progress, seen);
  }
}

TEST_F(Tasks, ACancelledTaskEndsWhenItsWorkerSaysSo) {
  const TaskReporter reporter = registry_->start("plan", "");
  EXPECT_FALSE(reporter.stop_token().stop_requested());
  EXPECT_TRUE(registry_->cancel(reporter.id()).ok());
  EXPECT_TRUE(reporter.stop_token().stop_requested());
  EXPECT_EQ(registry_->find(reporter.id())->state, TaskState::kRunning);
  reporter.fail({ErrorCode::kCancelled, "cancelled"});
  run();
  EXPECT_EQ(registry_->find(reporter.id())->state, TaskState::kCancelled);
  EXPECT_EQ(registry_->cancel(reporter.id()).error().code, ErrorCode::kConflict);
  EXPECT_EQ(registry_->cancel(99).error().code, ErrorCode::kNotFound);
}

TEST_F(Tasks, AWorkerThatVanishesFailsItsTask) {
  std::int64_t id = 0;
  {
    const TaskReporter reporter = registry_->start("scan", "");
    id = reporter.id();
    const TaskReporter copy = reporter;
    copy.progress(0.1, "scanning");
  }
  run();
  EXPECT_EQ(registry_->find(id)->state, TaskState::kFailed);
  EXPECT_EQ(registry_->find(id)->error->code, ErrorCode::kInternal);
}

TEST_F(Tasks, OnlyTheFirstEndCounts) {
  const TaskReporter reporter = registry_->start("scan", "");
  reporter.fail({ErrorCode::kUnavailable, "the scanner is off"});
  reporter.done({});
  reporter.progress(1, "late");
  run();
  EXPECT_EQ(registry_->find(reporter.id())->state, TaskState::kFailed);
  EXPECT_EQ(registry_->find(reporter.id())->text, "");
}

TEST_F(Tasks, TheLastHundredAreKeptAndRunningOnesNeverForgotten) {
  const TaskReporter running = registry_->start("first", "");
  for (int i = 0; i < 300; ++i) {
    registry_->start("short", "").done({});
    run();
  }
  EXPECT_EQ(registry_->list().size(), TaskRegistry::kKept);
  EXPECT_NE(registry_->find(running.id()), nullptr);
  EXPECT_EQ(registry_->find(2), nullptr);
  EXPECT_EQ(registry_->running().size(), 1U);
}

TEST_F(Tasks, ReportersOutliveTheirRegistry) {
  const TaskReporter reporter = registry_->start("scan", "");
  reporter.progress(0.5, "half");
  registry_.reset();
  EXPECT_TRUE(reporter.stop_token().stop_requested());
  reporter.done({});
  run();
}

TEST_F(Tasks, ManyThreadsMayReportAtOnce) {
  std::vector<TaskReporter> reporters;
  for (int i = 0; i < 8; ++i) reporters.push_back(registry_->start("work", ""));
  std::vector<std::thread> threads;
  threads.reserve(reporters.size());
  for (const TaskReporter& reporter : reporters) {
    threads.emplace_back([reporter] {
      for (int i = 0; i < 1000; ++i) reporter.progress(i / 1000.0, std::to_string(i));
      reporter.done({});
    });
  }
  while (!registry_->running().empty()) {
    reactor_.restart();
    reactor_.poll();
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Tasks, RoutesShowAndCancelThem) {
  Router router;
  bind_task_routes(router, *registry_);
  const TaskReporter reporter = registry_->start("plan", "matching");
  const auto ask = [&](const char* method, const std::string& target) {
    const Router::Match match = router.match(method, target);
    ApiReply answer = match.refusal;
    if (!match.route) return answer;
    ApiRequest request;
    request.path_params = match.path_params;
    match.route->handler(request, [&answer](ApiReply reply) { answer = std::move(reply); });
    return answer;
  };
  EXPECT_EQ(nlohmann::json::parse(ask("GET", "/api/v1/tasks").body)["tasks"].size(), 1U);
  EXPECT_EQ(nlohmann::json::parse(ask("GET", "/api/v1/tasks/1").body)["text"], "matching");
  EXPECT_EQ(ask("GET", "/api/v1/tasks/7").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/tasks/x").status, 400);
  EXPECT_EQ(ask("GET", "/api/v1/tasks/-1").status, 400);
  EXPECT_EQ(ask("DELETE", "/api/v1/tasks/1").status, 200);
  EXPECT_TRUE(reporter.stop_token().stop_requested());
}

// A plan's result may be megabytes: whoever has it is not sent it again, and what runs has none.
TEST_F(Tasks, AResultIsSentOnceToWhoeverKeepsIt) {
  Router router;
  bind_task_routes(router, *registry_);
  const TaskReporter reporter = registry_->start("plan", "matching");
  const auto ask = [&](const std::string& known) {
    const Router::Match match = router.match("GET", "/api/v1/tasks/1");
    ApiRequest request;
    request.path_params = match.path_params;
    request.if_none_match = known;
    ApiReply answer;
    match.route->handler(request, [&answer](ApiReply reply) { answer = std::move(reply); });
    return answer;
  };
  EXPECT_EQ(ask("").etag, "");
  reporter.done({{"pieces", {"A1", "A2"}}});
  run();
  const ApiReply whole = ask("");
  const auto told = nlohmann::json::parse(whole.body, nullptr, false);
  EXPECT_EQ(told["result"]["pieces"][1], "A2");
  EXPECT_EQ(told["state"], "done");
  EXPECT_EQ(told["schema_version"], 1);
  EXPECT_NE(whole.etag, "");
  EXPECT_EQ(ask(whole.etag).status, 304);
  EXPECT_EQ(ask(whole.etag).body, "");
}

// What a viewer keeps of it is not what an operator is told.
TEST_F(Tasks, AResultTellsViewersWhatWasFoundAndNotInWhichFile) {
  Router router;
  bind_task_routes(router, *registry_, {}, [](nlohmann::json&) {});
  const auto ask = [&](std::int64_t task, Role role, const std::string& known = "") {
    const Router::Match match = router.match("GET", "/api/v1/tasks/" + std::to_string(task));
    ApiRequest request;
    request.path_params = match.path_params;
    request.if_none_match = known;
    request.caller.role = role;
    ApiReply answer;
    match.route->handler(request, [&answer](ApiReply reply) { answer = std::move(reply); });
    return answer;
  };
  const auto result_of = [](const ApiReply& told) { return nlohmann::json::parse(told.body)["result"]; };
  registry_->start("integrity check", "reading").done({{"file", "/var/lib/v/v.db"}, {"seconds", 2.5}, {"sound", true}});
  registry_->start("find cameras", "looking")
      .done({{"cameras",
              {{{"device", "/dev/v4l/by-id/usb-A"}, {"node", "/dev/video0"}, {"name", "A"}, {"problem", ""}}}}});
  registry_->start("plan", "matching").done({{"name", "/oak"}, {"file", "/typed"}});
  run();
  const ApiReply whole = ask(1, Role::kOperator), less = ask(1, Role::kViewer);
  EXPECT_EQ(result_of(whole)["file"], "/var/lib/v/v.db");
  EXPECT_EQ(result_of(less),
            nlohmann::json({{"file", "(an operator is told where)"}, {"seconds", 2.5}, {"sound", true}}));
  EXPECT_NE(whole.etag, less.etag);
  EXPECT_EQ(ask(1, Role::kOperator, less.etag).status, 200) << "who was a viewer before is told all";
  EXPECT_EQ(ask(1, Role::kViewer, whole.etag).status, 200);
  EXPECT_EQ(ask(1, Role::kViewer, less.etag).status, 304);
  const auto camera = result_of(ask(2, Role::kViewer))["cameras"][0];
  EXPECT_EQ(camera["device"], "(an operator is told where)");
  EXPECT_EQ(camera["node"], "(an operator is told where)");
  EXPECT_EQ(camera["name"], "A");
  EXPECT_EQ(camera["problem"], "") << "it could be asked";
  EXPECT_EQ(result_of(ask(3, Role::kViewer)), nlohmann::json({{"name", "/oak"}, {"file", "/typed"}}));
}

}  // namespace
}  // namespace veneer::daemon
