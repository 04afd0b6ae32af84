// Which changes the audit log tells of, with whom, and what came of them: asked through the real router, written by the
// real database.
#include "daemon/news/change_audit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/threads/reactor_timer.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ChangeAuditTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(folder_ / "veneerd.db", reactor_);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    database_ = std::move(*opened);
    log_ = std::make_unique<AuditLog>(*database_, make_null_logger());
    tasks_ = std::make_unique<TaskRegistry>(reactor_, clock_, make_reactor_timer(reactor_),
                                            [this](const TaskView& task) { task_audit_->changed(task); });
    task_audit_ = std::make_unique<TaskAudit>(*tasks_, *log_);
    audit_ = std::make_unique<ChangeAudit>(
        ChangeAudit::Parts{reactor_, *database_, *log_, *task_audit_},
        [this](std::int64_t task, const Caller& by) { began_.push_back(fmt::format("{} by {}", task, by.who)); },
        make_null_logger());
    router_.on_change([this](const Router::Change& change) {
      if (audit_) audit_->note(change);
    });
  }

  void ask(const std::string& method, const std::string& path, const Caller& by, const std::string& body = "{}") {
    const auto match = router_.match(method, path);
    ASSERT_NE(match.route, nullptr);
    ApiRequest request;
    request.method = method, request.path = path, request.path_params = match.path_params;
    request.body = body, request.content_type = "application/json", request.caller = by;
    match.route->handler(request, [this](ApiReply reply) { replies_.push_back(std::move(reply)); });
  }
  // What is on its way is written, and what that sets off.
  void settle() {
    for (int quiet = 0; quiet < 3;) {
      database_->call([](Repositories&) { return 0; });
      reactor_.restart();
      quiet = reactor_.poll() == 0 ? quiet + 1 : 0;
    }
  }
  // "uid 1000 api.cancelJob POST ...", oldest first.
  std::vector<std::string> rows() {
    settle();
    const auto read = database_->call([](Repositories& r) { return r.audit.latest(1000); });
    std::vector<std::string> out;
    for (const db::AuditEntry& row : *read)
      out.insert(out.begin(), fmt::format("{} {} {}", row.who, row.what, row.detail));
    return out;
  }
  // While it lives the disk takes nothing.
  class SlowDisk {
   public:
    explicit SlowDisk(DatabaseThread& database) {
      database.async([wait = go_.get_future().share()](Repositories&) { return wait.wait(), 0; }, [](int) {});
    }
    ~SlowDisk() { go_.set_value(); }
    SlowDisk(const SlowDisk&) = delete;
    SlowDisk& operator=(const SlowDisk&) = delete;

   private:
    std::promise<void> go_;
  };

  const Caller anna_{Role::kOperator, "user anna", TransportKind::kTls};
  const Caller berta_{Role::kMaintainer, "uid 1001", TransportKind::kUnix};
  const Caller anybody_{Role::kNobody, "anonymous", TransportKind::kTcp};
  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  ManualClock clock_;
  std::unique_ptr<DatabaseThread> database_;
  std::unique_ptr<AuditLog> log_;
  std::unique_ptr<TaskRegistry> tasks_;
  std::unique_ptr<TaskAudit> task_audit_;
  std::unique_ptr<ChangeAudit> audit_;
  Router router_;
  std::vector<ApiReply> replies_;
  std::vector<std::string> began_;
};

TEST_F(ChangeAuditTest, WhatIsAskedStandsThereWithWhomBeforeWhatItWrites) {
  router_.bind("cancelJob", [this](const ApiRequest& request, const Reply& reply) {
    log_->write({0, utc_timestamp(), request.caller.who, "job.cancelled", "3"});
    reply(ApiReply::json({{"state", "cancelled"}}));
  });
  ask("POST", "/api/v1/jobs/3/cancel", anna_);
  ask("POST", "/api/v1/jobs/4/cancel", berta_);
  EXPECT_THAT(rows(), ElementsAre("user anna api.cancelJob POST /api/v1/jobs/3/cancel", "user anna job.cancelled 3",
                                  "uid 1001 api.cancelJob POST /api/v1/jobs/4/cancel", "uid 1001 job.cancelled 3"));
}

TEST_F(ChangeAuditTest, WhatOnlyAsksLeavesNoRow) {
  router_.bind("getStatus", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({{"state", "Idle"}})); });
  ask("GET", "/api/v1/status", anna_);
  EXPECT_EQ(replies_.size(), 1U);
  EXPECT_THAT(rows(), IsEmpty());
}

TEST_F(ChangeAuditTest, ARefusalIsASecondRowThatSaysWhy) {
  router_.bind("cancelJob", [](const ApiRequest&, const Reply& reply) {
    reply(ApiReply::error(Error{ErrorCode::kConflict, "the job is under way: stop it first"}));
  });
  ask("POST", "/api/v1/jobs/3/cancel", anna_);
  EXPECT_THAT(rows(), ElementsAre(StartsWith("user anna api.cancelJob POST"),
                                  AllOf(StartsWith("user anna api.cancelJob.refused "),
                                        HasSubstr("the job is under way: stop it first"))));
}

// Nobody refused it: the cell could not do it.
TEST_F(ChangeAuditTest, WhatTheCellCouldNotDoIsNotCalledRefused) {
  router_.bind("cancelJob", [](const ApiRequest&, const Reply& reply) {
    reply(ApiReply::error(Error{ErrorCode::kStorage, "the disk is full: make room"}));
  });
  ask("POST", "/api/v1/jobs/3/cancel", anna_);
  EXPECT_THAT(rows(), ElementsAre(StartsWith("user anna api.cancelJob POST"),
                                  AllOf(StartsWith("user anna api.cancelJob.failed "),
                                        HasSubstr("the disk is full: make room"))));
}

TEST_F(ChangeAuditTest, AnErrorAboutAChangeThatHoldsIsNone) {
  router_.bind("cancelJob", [](const ApiRequest&, const Reply& reply) {
    ApiReply made = ApiReply::error(Error{ErrorCode::kUnavailable, "it is cancelled, and the lists are old"});
    made.changed = true;
    reply(std::move(made));
  });
  ask("POST", "/api/v1/jobs/3/cancel", anna_);
  EXPECT_THAT(rows(), ElementsAre(StartsWith("user anna api.cancelJob POST")));
}

// Threads that answer questions refuse some changes themselves.
TEST_F(ChangeAuditTest, AReplyOfAnotherThreadIsNotedInTheReactorsTurn) {
  router_.bind("cancelJob", [](const ApiRequest&, const Reply& reply) {
    std::thread([&reply] { reply(ApiReply::error(Error{ErrorCode::kNotFound, "there is no job 3"})); }).join();
  });
  ask("POST", "/api/v1/jobs/3/cancel", anna_);
  EXPECT_THAT(rows(), ElementsAre(StartsWith("user anna api.cancelJob POST"),
                                  AllOf(StartsWith("user anna api.cancelJob.refused "), HasSubstr("no job 3"))));
  // After its end nobody is there to note it.
  std::optional<Reply> late;
  router_.bind("archiveJob", [&](const ApiRequest&, const Reply& reply) { late = reply; });
  ask("POST", "/api/v1/jobs/3/archive", anna_);
  std::thread([&] { (*late)(ApiReply::error(Error{ErrorCode::kNotFound, "there is no job 3"})); }).join();
  audit_.reset();
  EXPECT_THAT(rows().back(), StartsWith("user anna api.archiveJob POST"));
}

TEST_F(ChangeAuditTest, WhoSignsInIsNotedUnderTheNameAndOnlyOnceSignedIn) {
  router_.bind("openSession", [](const ApiRequest& request, const Reply& reply) {
    if (request.body.text().find("right") == std::string::npos)
      return reply(ApiReply::error(403, "forbidden", "no such user or password"));
    ApiReply made = ApiReply::json({{"ok", true}});
    made.signed_in = "user anna";
    reply(std::move(made));
  });
  ask("POST", "/api/v1/session", anybody_, R"({"user":"anna","password":"wrong"})");
  EXPECT_THAT(rows(), IsEmpty()) << "anybody may try";
  ask("POST", "/api/v1/session", anybody_, R"({"user":"anna","password":"right"})");
  EXPECT_THAT(rows(), ElementsAre(R"(user anna api.openSession POST /api/v1/session {"user":"anna"})"));
}

TEST_F(ChangeAuditTest, LongWorkHasARowAtItsEndOfWhoeverAskedForIt) {
  std::vector<TaskReporter> scans;
  router_.bind("scan", [&](const ApiRequest&, const Reply& reply) {
    scans.push_back(tasks_->start("scan", "scanning"));
    reply(ApiReply::task(scans.back().id()));
  });
  for (const Caller& by : {anna_, berta_, anna_, berta_}) ask("POST", "/api/v1/scans", by);
  EXPECT_THAT(began_, ElementsAre("1 by user anna", "2 by uid 1001", "3 by user anna", "4 by uid 1001"));
  const auto asked = StartsWith("user anna api.scan POST"), asked_too = StartsWith("uid 1001 api.scan POST");
  EXPECT_THAT(rows(), ElementsAre(asked, asked_too, asked, asked_too));
  scans[3].fail({ErrorCode::kRefused, "there is no panel on the glass"});
  settle();
  scans[0].done({{"panel", "P-0007"}});
  settle();
  scans[1].fail({ErrorCode::kCancelled, "scanning was cancelled"});
  settle();
  scans[2].fail({ErrorCode::kDeviceFault, "the lamp is cold"});
  auto ends = rows();
  ends.erase(ends.begin(), ends.begin() + 4);
  EXPECT_THAT(ends, ElementsAre("uid 1001 api.scan.failed there is no panel on the glass",
                                R"(user anna api.scan.done {"panel":"P-0007"})",
                                "uid 1001 api.scan.cancelled scanning was cancelled",
                                "user anna api.scan.failed the lamp is cold"));
}

TEST_F(ChangeAuditTest, WorkThatWasOverBeforeTheReplyHasItsRowToo) {
  router_.bind("scan", [&](const ApiRequest&, const Reply& reply) {
    const TaskReporter scan = tasks_->start("scan", "scanning");
    scan.done({{"panel", "P-0007"}});
    reactor_.restart(), reactor_.poll();
    reply(ApiReply::task(scan.id()));
  });
  ask("POST", "/api/v1/scans", anna_);
  EXPECT_THAT(rows(), ElementsAre(StartsWith("user anna api.scan POST"), StartsWith("user anna api.scan.done ")));
}

TEST_F(ChangeAuditTest, WorkThatNobodyAskedForHasNoRowOfAnybody) {
  tasks_->start("backup", "copying").fail({ErrorCode::kStorage, "the disk is full"});
  EXPECT_THAT(rows(), IsEmpty()) << "CellNews tells of it";
}

TEST_F(ChangeAuditTest, WhatIsAboutToBeDoneIsWrittenWhenThatIsSaid) {
  std::thread([this] { EXPECT_TRUE(audit_->note_now("uid 1000", db::kDeviceChosen, "camera").ok()); }).join();
  const auto chosen = database_->call([](Repositories& r) { return r.audit.devices_were_chosen(); });
  EXPECT_TRUE(chosen.ok() && *chosen);
  EXPECT_THAT(rows(), ElementsAre("uid 1000 device.choose camera"));
}

TEST_F(ChangeAuditTest, WhoAsksFasterThanTheDiskTakesRowsIsToAskAgain) {
  router_.bind("cancelJob", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({})); });
  {
    const SlowDisk disk(*database_);
    for (std::size_t i = 0; i < AuditLog::kMostOfOne; ++i) {
      EXPECT_TRUE(audit_->may_be_noted(anna_).ok()) << i;
      ask("POST", "/api/v1/jobs/3/cancel", anna_);
    }
    const Status more = audit_->may_be_noted(anna_);
    ASSERT_FALSE(more.ok());
    EXPECT_EQ(more.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(more.error().message, HasSubstr("try again"));
    EXPECT_TRUE(audit_->may_be_noted(berta_).ok()) << "one is not held up by the other";
  }
  EXPECT_EQ(rows().size(), AuditLog::kMostOfOne);
  EXPECT_TRUE(audit_->may_be_noted(anna_).ok());
}

}  // namespace
}  // namespace veneer::daemon
