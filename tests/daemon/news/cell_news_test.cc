// What the cell tells without being asked: to clients of the real event stream, as alarms, in the audit log, and to
// whoever is away.
#include "daemon/news/cell_news.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tests/daemon/news/told_cell.h"
#include "tests/support/api_server.h"
#include "tests/support/event_listener.h"
#include "tests/support/sim_laser.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

// The unit as a test sets it.
struct SetUnit final : UnitState {
  const CellView& view() const override { return now; }
  bool is_connected() const override { return false; }
  const LaserLimits& limits() const override { return machine; }
  Consent consent() const override { return {}; }
  Status still_holds(const Consent&) const override { return Ok(); }
  Status at_rest() const override { return Ok(); }
  CellView now;
  LaserLimits machine;
};

// Whoever is away: what is sent there, in order.
class SentNotices final : public WorkRunner {
 public:
  Result<json> run(const WorkOrder& order, const TaskProgress&, std::stop_token) override {
    const std::lock_guard lock(mutex_);
    sent_.push_back(json::parse(order.request.at("body").get<std::string>()));
    more_.notify_all();
    return json{{"delivered", true}};
  }
  // "job: job 3 is done", all up to the first that begins so.
  std::vector<std::string> up_to(const std::string& last) {
    std::unique_lock lock(mutex_);
    std::vector<std::string> out;
    more_.wait(lock, [&] {
      out.clear();
      for (const json& one : sent_) out.push_back(words(one));
      return !out.empty() && out.back().starts_with(last);
    });
    return out;
  }

 private:
  static std::string words(const json& one) {
    return fmt::format("{}{}: {}", one["urgent"].get<bool>() ? "urgent " : "", one["event"].get<std::string>(),
                       one["message"].get<std::string>());
  }

  std::mutex mutex_;
  std::condition_variable more_;
  std::vector<json> sent_;
};

// All that CellNews works with, on one reactor.
struct NewsDesk {
  NewsDesk(testing::ApiServer& server, const std::filesystem::path& folder, WorkRunner& others)
      : laser(server.reactor()),
        database(*DatabaseThread::open(folder / "veneerd.db", server.reactor())),
        cell(server.reactor(), folder, *database, unit, options, laser,
             [this](const TaskView& task) {
               if (news) news->changed(task);
             }),
        audit(*database, make_null_logger()) {
    cell.config.notify.webhook = NetworkAddress{false, "127.0.0.1", 9, "/"};
    cell.counts.known = true;
    news = std::make_unique<CellNews>(
        CellNews::Parts{cell.config, unit, laser, cell.status, server.hub(), cell.tasks, cell.alarms, audit, others,
                        metrics, cell.keeper, cell.clock},
        [this] { ++alarms_told; }, make_null_logger());
    news->go_on_from_before();
  }

  SetUnit unit;
  RunnerOptions options;
  tests::SimLaser laser;
  std::unique_ptr<DatabaseThread> database;
  Metrics metrics;
  int alarms_told = 0;
  std::unique_ptr<CellNews> news;
  tests::ToldCell cell;
  AuditLog audit;
};

class CellNewsTest : public ::testing::Test {
 protected:
  CellNewsTest() { open(); }
  ~CellNewsTest() override { close(); }
  void open() {
    on([this] {
      desk_ = std::make_unique<NewsDesk>(server_, folder_.path(), others_);
      desk_->laser.connect([](const LaserEvent&) {});
    });
  }
  void close() {
    on([this] {
      if (desk_) desk_->news.reset();
      desk_.reset();
    });
  }
  template <class Act>
  std::invoke_result_t<Act> on(Act act) {
    return server_.on_reactor(std::move(act));
  }

  // What this client, which has had its hello, was sent since: "task 1 running 0.50 half", "alarms".
  std::vector<std::string> heard(testing::EventListener& client) {
    on([this, mark = ++marks_] { server_.hub().broadcast_passing({{"type", "mark"}, {"mark", mark}}); });
    std::vector<std::string> out;
    for (json event = client.next(); event.value("mark", 0) != marks_; event = client.next()) {
      if (event["type"] == "mark") continue;  // for another client
      const json task = event.value("task", json());
      out.push_back(task.is_null() ? event["type"].get<std::string>()
                                   : fmt::format("task {} {} {:.2f} {}", task["id"].get<int>(),
                                                 task["state"].get<std::string>(), task["progress"].get<double>(),
                                                 task.value("error", json()).is_null()
                                                     ? task["text"].get<std::string>()
                                                     : task["error"]["message"].get<std::string>()));
    }
    return out;
  }
  // What the event of the next task that is done tells of its result.
  static json summary_of_done(testing::EventListener& client) {
    for (json event = client.next();; event = client.next())
      if (event["type"] == "task" && event["task"]["state"] == "done") return event["task"].value("summary", json());
  }
  void become_unconnected(const std::string& why) {
    on([&] {
      desk_->laser.says_why = true, desk_->laser.present = false;
      desk_->laser.absence = why;
      desk_->laser.connect([](const LaserEvent&) {});
    });
  }
  TaskReporter start(const std::string& kind) {
    return on([&] { return desk_->cell.tasks.start(kind, "going on"); });
  }
  // On the reactor, behind what is ready there.
  void settle() {
    on([] {});
  }
  std::vector<std::string> alarms() {
    return on([this] {
      std::vector<std::string> out;
      for (const Alarm& alarm : desk_->cell.alarms.alarms())
        out.push_back(fmt::format("{} {}", to_string(alarm.state), alarm.what.sentence));
      return out;
    });
  }
  // "veneerd alarm.new ...", oldest first.
  std::vector<std::string> audited() {
    const auto read = desk_->database->call([](Repositories& r) { return r.audit.latest(100); });
    std::vector<std::string> out;
    for (const db::AuditEntry& row : *read)
      out.insert(out.begin(), fmt::format("{} {} {}", row.who, row.what, row.detail));
    return out;
  }
  void become(CellState state, const std::string& reason = "") {
    on([&] {
      desk_->unit.now.state = state;
      desk_->unit.now.reason = reason;
      desk_->news->unit_changed();
    });
  }
  void look() {
    on([this] { desk_->news->look(); });
  }
  void pass(Duration time) {
    on([&] { desk_->cell.clock.advance(time), desk_->news->look_for_untold(); });
  }

  testing::TempDirectory folder_;
  SentNotices others_;
  testing::ApiServer server_;
  std::unique_ptr<NewsDesk> desk_;
  int marks_ = 0;
  const Caller anna_{Role::kOperator, "user anna", TransportKind::kTls};
};

TEST_F(CellNewsTest, EveryClientHearsOfEachTaskOnceAndInOrder) {
  testing::EventListener looks(server_.port()), works(server_.port(), server_.console_session());
  looks.next(), works.next();
  const TaskReporter scan = start("scan"), plan = start("plan");
  scan.progress(0.25, "a quarter");
  settle();
  EXPECT_THAT(heard(looks), ElementsAre("task 1 running 0.00 going on", "task 2 running 0.00 going on"))
      << "too soon for another one";
  on([this] { desk_->cell.clock.advance(TaskRegistry::kEventInterval); });
  scan.progress(0.5, "half");
  settle();
  plan.done({{"plan", 7}});
  settle();
  scan.done({{"panel", "P-0003"}});
  settle();
  EXPECT_THAT(heard(looks),
              ElementsAre("task 1 running 0.50 half", "task 2 done 1.00 going on", "task 1 done 1.00 half"));
  EXPECT_THAT(heard(works),
              ElementsAre("task 1 running 0.00 going on", "task 2 running 0.00 going on", "task 1 running 0.50 half",
                          "task 2 done 1.00 going on", "task 1 done 1.00 half"));
}

TEST_F(CellNewsTest, AFailureIsAnAlarmBehindTheTaskThatFailed) {
  testing::EventListener client(server_.port());
  client.next();
  start("scan").fail({ErrorCode::kDeviceFault, "the lamp is cold"});
  settle();
  EXPECT_THAT(heard(client),
              ElementsAre("task 1 running 0.00 going on", "task 1 failed 0.00 the lamp is cold", "alarms"));
  EXPECT_THAT(alarms(), ElementsAre("returned scan: the lamp is cold"));
  EXPECT_EQ(on([this] { return desk_->alarms_told; }), 1);
  EXPECT_THAT(others_.up_to("alarm"), ElementsAre("alarm: scan: the lamp is cold"));
}

// "the audit log keeps all" (docs/openapi.json), of work that nobody asked for as well.
TEST_F(CellNewsTest, TheAuditLogKeepsEveryAlarm) {
  start("backup").fail({ErrorCode::kStorage, "the disk is full"});
  settle();
  become(CellState::kAborted, "the laser stopped answering"), look();
  become(CellState::kStopped), look(), look();
  EXPECT_THAT(audited(),
              ElementsAre("veneerd alarm.new backup: the disk is full", "veneerd alarm.new the laser stopped answering",
                          "veneerd alarm.returned the laser stopped answering"));
}

TEST_F(CellNewsTest, AnAlarmIsToldWhenItBeginsAndWhenItEnds) {
  testing::EventListener client(server_.port());
  client.next();
  look();
  become(CellState::kHeld, "the lid was opened"), look(), look();
  EXPECT_THAT(heard(client), ElementsAre("alarms"));
  become(CellState::kHeld, "the lid was opened; close it"), look();
  EXPECT_THAT(heard(client), IsEmpty()) << "it is the same one";
  become(CellState::kExecute), look(), look();
  EXPECT_THAT(heard(client), ElementsAre("alarms"));
  EXPECT_THAT(alarms(), ElementsAre("returned the lid was opened; close it"));
  EXPECT_EQ(on([this] { return desk_->alarms_told; }), 2);
}

TEST_F(CellNewsTest, NoAlarmBeginsOrEndsBeforeTheDatabaseWasCounted) {
  become(CellState::kAborted, "the laser stopped answering"), look();
  on([this] { desk_->cell.counts.known = false; });
  become(CellState::kStopped), look();
  EXPECT_THAT(alarms(), ElementsAre("new the laser stopped answering"));
}

TEST_F(CellNewsTest, ARefusalIsAnAlarmOnceNobodyLookedForItInTime) {
  const auto refused = [this](bool looks) {
    const TaskReporter plan = start("plan");
    on([&] { desk_->news->began(plan.id(), anna_); });
    plan.fail({ErrorCode::kRefused, "there is not enough wood"});
    settle();
    if (looks) on([&] { desk_->news->told(*desk_->cell.tasks.find(plan.id()), anna_); });
  };
  refused(true), refused(false);
  pass(std::chrono::seconds(10));
  EXPECT_THAT(alarms(), IsEmpty()) << "there is time to look";
  pass(std::chrono::milliseconds(1));
  EXPECT_THAT(alarms(), ElementsAre("returned plan: there is not enough wood"));
  pass(std::chrono::hours(1));
  EXPECT_THAT(alarms(), SizeIs(1)) << "once";
}

// It is the cell that says what is told of a file; who only looks on is told the same as by GET /alarms.
TEST_F(CellNewsTest, ViewersAreToldOfAFailureWithoutPortsAndPaths) {
  testing::EventListener looks(server_.port()), works(server_.port(), server_.console_session());
  const json hello = looks.next();
  works.next();
  start("scan").fail({ErrorCode::kDeviceFault, "/dev/ttyUSB7 is gone, and /var/lib/veneerd/scan.tif is not whole"});
  settle();
  EXPECT_THAT(heard(works), Contains(HasSubstr("/var/lib/veneerd/scan.tif")));
  const auto less = heard(looks);
  EXPECT_THAT(less, Contains(AllOf(HasSubstr("is not whole"), Not(HasSubstr("/var/lib")), Not(HasSubstr("ttyUSB7")))));
  EXPECT_THAT(less, Not(Contains(HasSubstr("ttyUSB7"))));
  testing::EventListener again(
      server_.port(), "", 0,
      fmt::format("?life={}&since={}", hello["life"].get<std::string>(), hello["seq"].get<int>()));
  again.next();
  const auto missed = heard(again);
  EXPECT_THAT(missed, Contains(HasSubstr("is not whole"))) << "whoever comes back is told what it missed";
  EXPECT_THAT(missed, Not(Contains(HasSubstr("ttyUSB7"))));
}

// Boards that are found are named by their sockets, which no configuration knows.
TEST_F(CellNewsTest, ViewersAreToldNoSocketsOfBoardsThatAreNotTheLaser) {
  const std::string why =
      "no laser is plugged in at usb:1-9; boards of its kind answer at usb:1-2.4 and usb:1-3: name one as `port`";
  testing::EventListener looks(server_.port()), works(server_.port(), server_.console_session());
  looks.next(), works.next();
  become_unconnected(why);
  start("laser run").fail({ErrorCode::kUnavailable, why});
  settle();
  EXPECT_THAT(heard(works), Contains(HasSubstr(why)));
  const auto less = heard(looks);
  EXPECT_THAT(less, Contains(HasSubstr("an operator is told why")));
  EXPECT_THAT(less, Not(Contains(HasSubstr("usb:1-"))));
}

TEST_F(CellNewsTest, ViewersAreToldWhatPeopleTypedAsTheyTypedIt) {
  testing::EventListener looks(server_.port());
  looks.next();
  start("plan").done({{"plan", 7}, {"name", "oak =/left/ (/2)"}, {"panels", {"P-0001 /top", "/dev"}}});
  settle();
  const json summary = summary_of_done(looks);
  EXPECT_EQ(summary["name"], "oak =/left/ (/2)");
  EXPECT_EQ(summary["panels"], json({"P-0001 /top", "/dev"}));
}

TEST_F(CellNewsTest, ViewersAreNotToldWhichFileWasChecked) {
  testing::EventListener looks(server_.port()), works(server_.port(), server_.console_session());
  looks.next(), works.next();
  start("integrity check").done({{"file", "/var/lib/veneerd/veneerd.db"}, {"seconds", 2.5}, {"sound", true}});
  settle();
  EXPECT_EQ(summary_of_done(works)["file"], "/var/lib/veneerd/veneerd.db");
  const json less = summary_of_done(looks);
  EXPECT_EQ(less["file"], "(an operator is told where)");
  EXPECT_EQ(less["seconds"], 2.5);
  EXPECT_EQ(less["sound"], true);
}

TEST_F(CellNewsTest, WhoIsAwayHearsOnceThatAJobIsDoneAndThatSomebodyIsNeeded) {
  on([this] {
    desk_->unit.now.job = JobView{JobId{3}, "portrait", 12, 11, 1, {}, 0};
    desk_->unit.now.load.emplace().panel = PanelId{"P-0001"};
  });
  become(CellState::kSuspended), look(), look();
  become(CellState::kExecute), look();
  become(CellState::kComplete), look(), look();
  become(CellState::kAborted, "the laser stopped answering"), look();
  EXPECT_THAT(others_.up_to("urgent alarm"),
              ElementsAre("operator: Lay panel P-0001 on the bed, face down: the camera finds it there.",
                          "job: job 3 (portrait) is done: 11 of 12 pieces are cut, 1 suspect",
                          "urgent alarm: the laser stopped answering"));
}

// The next Reset may come before the cell looks again whether something is due.
TEST_F(CellNewsTest, WhoIsAwayHearsOfAJobThatIsDoneHoweverSoonTheNextOneBegins) {
  on([this] { desk_->unit.now.job = JobView{JobId{3}, "portrait", 12, 12, 0, {}, 0}; });
  become(CellState::kExecute);
  become(CellState::kComplete);
  on([this] { desk_->unit.now.job.reset(); });
  become(CellState::kResetting);
  look();
  become(CellState::kAborted, "the laser stopped answering"), look();
  EXPECT_THAT(others_.up_to("urgent alarm"), ElementsAre("job: job 3 (portrait) is done: 12 of 12 pieces are cut",
                                                         "urgent alarm: the laser stopped answering"));
}

// The unit is Unsuspending and Completing meanwhile, however short it is, and where it was refused.
TEST_F(CellNewsTest, AJobThatWasDoneIsNotToldAgainAfterARecut) {
  on([this] { desk_->unit.now.job = JobView{JobId{3}, "portrait", 12, 12, 0, {}, 0}; });
  become(CellState::kExecute);
  become(CellState::kComplete), look();
  become(CellState::kUnsuspending), become(CellState::kCompleting), become(CellState::kComplete), look();
  become(CellState::kUnsuspending), look(), become(CellState::kComplete), look();
  become(CellState::kAborted, "the laser stopped answering"), look();
  EXPECT_THAT(others_.up_to("urgent alarm"), ElementsAre("job: job 3 (portrait) is done: 12 of 12 pieces are cut",
                                                         "urgent alarm: the laser stopped answering"));
}

// As after a piece of it was made again.
TEST_F(CellNewsTest, AJobThatIsDoneOnceMoreAfterResetIsToldOnceMore) {
  on([this] { desk_->unit.now.job = JobView{JobId{3}, "portrait", 12, 12, 0, {}, 0}; });
  become(CellState::kComplete);
  on([this] { desk_->unit.now.job.reset(); });
  become(CellState::kResetting);
  on([this] { desk_->unit.now.job = JobView{JobId{3}, "portrait", 13, 13, 0, {}, 0}; });
  become(CellState::kSuspending), become(CellState::kExecute), become(CellState::kComplete);
  become(CellState::kAborted, "the laser stopped answering"), look();
  EXPECT_THAT(others_.up_to("urgent alarm"), ElementsAre("job: job 3 (portrait) is done: 12 of 12 pieces are cut",
                                                         "job: job 3 (portrait) is done: 13 of 13 pieces are cut",
                                                         "urgent alarm: the laser stopped answering"));
}

TEST_F(CellNewsTest, ATryReachesWhoeverIsToldOrSaysThatNobodyIs) {
  const auto task = on([this] { return desk_->news->try_notices(); });
  ASSERT_TRUE(task.ok());
  EXPECT_THAT(others_.up_to("alarm"), ElementsAre(StartsWith("alarm: This is a try")));
  close();
  on([this] {
    desk_ = std::make_unique<NewsDesk>(server_, folder_.path(), others_);
    desk_->news.reset();
    desk_->cell.config.notify.webhook.reset();
    desk_->news = std::make_unique<CellNews>(
        CellNews::Parts{desk_->cell.config, desk_->unit, desk_->laser, desk_->cell.status, server_.hub(),
                        desk_->cell.tasks, desk_->cell.alarms, desk_->audit, others_, desk_->metrics,
                        desk_->cell.keeper, desk_->cell.clock},
        [] {}, make_null_logger());
  });
  const auto nobody = on([this] { return desk_->news->try_notices(); });
  EXPECT_EQ(nobody.error().code, ErrorCode::kConflict);
}

TEST_F(CellNewsTest, TasksAndAlarmsAreThereAfterARestartAndWhatWasUnderWayIsAnAlarm) {
  become(CellState::kAborted, "the laser stopped answering"), look();
  const TaskReporter plan = start("plan"), scan = start("scan");
  plan.done({{"plan", 7}});
  settle();
  close(), open();
  EXPECT_THAT(alarms(), ElementsAre("new the laser stopped answering",
                                    AllOf(StartsWith("returned scan: "), HasSubstr("start it again"))));
  EXPECT_EQ(on([&] { return desk_->cell.tasks.find(plan.id())->state; }), TaskState::kDone);
  EXPECT_EQ(on([&] { return desk_->cell.tasks.find(scan.id())->state; }), TaskState::kFailed);
  EXPECT_THAT(audited(), Contains(StartsWith("veneerd task.unfinished task 2, scan: ")));
  EXPECT_GT(start("scan").id(), scan.id()) << "no number is given twice";
  // Said once: the next start finds it over.
  settle();
  become(CellState::kAborted, "the laser stopped answering"), look();
  close(), open();
  const auto after = alarms();
  EXPECT_THAT(after, Contains("new the laser stopped answering"));
  EXPECT_EQ(std::ranges::count_if(after, [](const auto& one) { return one.starts_with("returned scan: the cell's"); }),
            1);
}

TEST_F(CellNewsTest, ARefusalThatNobodySawWaitsForWhoeverAskedAfterARestart) {
  const TaskReporter plan = start("plan"), other = start("plan");
  for (const TaskReporter* one : {&plan, &other}) {
    on([&] { desk_->news->began(one->id(), anna_); });
    one->fail({ErrorCode::kRefused, fmt::format("no wood for {}", one->id())});
  }
  settle();
  close(), open();
  on([&] { desk_->news->told(*desk_->cell.tasks.find(plan.id()), anna_); });
  pass(std::chrono::seconds(10));
  EXPECT_THAT(alarms(), IsEmpty());
  pass(std::chrono::milliseconds(1));
  EXPECT_THAT(alarms(), ElementsAre("returned plan: no wood for 2"));
}

}  // namespace
}  // namespace veneer::daemon
