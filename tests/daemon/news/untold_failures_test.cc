#include "daemon/news/untold_failures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const TimePoint kFailedAt{};

TaskView failed_task(std::int64_t id, ErrorCode code = ErrorCode::kRefused, std::string kind = "plan") {
  TaskView task;
  task.id = id;
  task.kind = std::move(kind);
  task.state = TaskState::kFailed;
  task.error = Error{code, "no"};
  return task;
}

class UntoldFailuresTest : public ::testing::Test {
 protected:
  UntoldFailures::Listens listens() {
    return [this](const std::string& who) { return stream.contains(who); };
  }
  void begin(std::int64_t task, const std::string& who, TransportKind transport) {
    failures.began(task, false, {Role::kOperator, who, transport}, listens());
  }
  void end(const TaskView& task) { failures.ended(task, kFailedAt, listens()); }
  std::vector<std::int64_t> untold() {
    std::vector<std::int64_t> out;
    for (const TaskView& task : failures.take_before(kFailedAt + std::chrono::seconds(1))) out.push_back(task.id);
    return out;
  }

  UntoldFailures failures;
  std::set<std::string> stream;
};

TEST(Refusals, AreWhatThePersonWhoAskedCanMend) {
  for (const auto code : {ErrorCode::kInvalidArgument, ErrorCode::kConflict, ErrorCode::kRefused, ErrorCode::kNotFound})
    EXPECT_TRUE(is_refusal(failed_task(1, code))) << to_string(code);
  for (const auto code : {ErrorCode::kUnavailable, ErrorCode::kTimeout, ErrorCode::kDisconnected,
                          ErrorCode::kDeviceFault, ErrorCode::kStorage, ErrorCode::kInternal})
    EXPECT_FALSE(is_refusal(failed_task(1, code))) << to_string(code);
  EXPECT_FALSE(is_refusal(failed_task(1, ErrorCode::kRefused, "backup")));
  EXPECT_FALSE(is_refusal(failed_task(1, ErrorCode::kConflict, "integrity check")));
}

TEST_F(UntoldFailuresTest, AreThoseThatNobodyLookedAt) {
  begin(1, "uid 1000", TransportKind::kUnix);
  begin(2, "uid 1000", TransportKind::kUnix);
  end(failed_task(1)), end(failed_task(2));
  EXPECT_THAT(failures.take_before(kFailedAt), IsEmpty()) << "there is time to look";
  failures.told(failed_task(1), "uid 1001");
  failures.told(failed_task(2), "uid 1000");
  EXPECT_THAT(untold(), ElementsAre(1)) << "somebody else looked";
  EXPECT_THAT(failures.kept(), IsEmpty());
  EXPECT_THAT(untold(), IsEmpty()) << "told once";
}

TEST_F(UntoldFailuresTest, AreNotThoseThatTheStreamTold) {
  stream = {"console link 3 of uid 1000", "uid 1000"};
  begin(1, "console link 3 of uid 1000", TransportKind::kTcp);
  begin(2, "console link 4 of uid 1000", TransportKind::kTcp);
  begin(3, "uid 1000", TransportKind::kUnix);
  end(failed_task(1)), end(failed_task(2)), end(failed_task(3));
  EXPECT_THAT(untold(), ElementsAre(2, 3)) << "over the socket another program of that user may listen";
}

TEST_F(UntoldFailuresTest, MayEndBeforeItIsKnownWhoAsked) {
  end(failed_task(1)), end(failed_task(2)), end(failed_task(3, ErrorCode::kInternal));
  stream = {"user anna"};
  failures.began(1, true, {Role::kOperator, "user anna", TransportKind::kTls}, listens());
  failures.began(2, true, {Role::kOperator, "uid 1000", TransportKind::kUnix}, listens());
  failures.began(3, true, {Role::kOperator, "uid 1000", TransportKind::kUnix}, listens());
  EXPECT_THAT(untold(), ElementsAre(2)) << "and what is no refusal is not kept";
}

TEST_F(UntoldFailuresTest, AreNotThoseThatWereToldBeforeItIsKnownWhoAsked) {
  end(failed_task(1)), end(failed_task(2));
  failures.told(failed_task(1), "uid 1000");
  failures.told(failed_task(2), "uid 1001");
  for (const std::int64_t task : {1, 2})
    failures.began(task, true, {Role::kOperator, "uid 1000", TransportKind::kUnix}, listens());
  EXPECT_THAT(untold(), ElementsAre(2)) << "somebody else looked";
}

TEST_F(UntoldFailuresTest, OutliveTheDaemonWithWhoAsked) {
  begin(1, "uid 1000", TransportKind::kUnix);
  begin(2, "uid 1000", TransportKind::kUnix);
  end(failed_task(1)), end(failed_task(2)), end(failed_task(3));
  UntoldFailures after;
  for (const auto& one : failures.kept()) after.go_on(failed_task(one.task), one, kFailedAt);
  EXPECT_FALSE(after.told(failed_task(1), "uid 1001"));
  EXPECT_TRUE(after.told(failed_task(1), "uid 1000")) << "whoever asked has come back to look";
  EXPECT_THAT(after.take_before(kFailedAt), IsEmpty()) << "and there is time to";
  std::vector<std::int64_t> left;
  for (const TaskView& task : after.take_before(kFailedAt + std::chrono::seconds(1))) left.push_back(task.id);
  EXPECT_THAT(left, ElementsAre(2, 3));
}

}  // namespace
}  // namespace veneer::daemon
