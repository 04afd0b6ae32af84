// What outlives the daemon besides its database: alarms and tasks.
#include <gmock/gmock.h>

#include <fstream>
#include <string>

#include "daemon/news/kept_alarms.h"
#include "daemon/news/kept_tasks.h"
#include "daemon/records/kept_file.h"
#include "daemon/threads/reactor_timer.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr const char* kBefore = "2026-05-01T07:30:00.000Z";
constexpr const char* kAfter = "2026-05-01T08:00:00.000Z";

TEST(KeptAlarms, AreTheSameAfterARestartAndSeenByWhomTheyWere) {
  AlarmBook before;
  before.take({{"suspect 3", false, "2 pieces", 2}, {"aborted", true, "the laser stopped answering"}}, kBefore);
  before.happened({"task 7", false, "scan: the lamp is cold"}, kBefore);
  ASSERT_TRUE(before.acknowledge(1, "user anna", kBefore).ok());

  auto after = book_from_json(json::parse(book_to_json(before).dump()));
  ASSERT_TRUE(after.has_value());
  EXPECT_FALSE(after->take({{"suspect 3", false, "2 pieces", 2}, {"aborted", true, "as before"}}, kAfter).any());
  EXPECT_EQ(after->alarms()[0].state, AlarmState::kAcknowledged);
  EXPECT_EQ(after->alarms()[0].seen_by, "user anna");
  EXPECT_EQ(after->alarms()[1].since, kBefore);
  EXPECT_EQ(after->alarms()[2].state, AlarmState::kReturned) << "nobody saw that the scan failed";
  EXPECT_FALSE(after->alarms()[2].lasting);

  const auto changes = after->take({{"suspect 3", false, "3 pieces", 3}}, kAfter);
  EXPECT_THAT(changes.ended, SizeIs(2)) << "the abort is over, and two suspects are three";
  ASSERT_THAT(changes.begun, SizeIs(1));
  EXPECT_EQ(changes.begun[0].id, 4 + kAlarmsSkipped) << "no number is given twice, of one that was not written either";
}

// Of 12 pieces 10 were settled and 3 more became suspect while nobody looked: that is worse than what was left.
TEST(KeptAlarms, WhatEasedIsToBeWrittenToo) {
  AlarmBook book;
  book.take({{"suspect 3", false, "12 pieces", 12}}, kBefore);
  ASSERT_TRUE(book.acknowledge(1, "user anna", kBefore).ok());
  EXPECT_FALSE(book.take({{"suspect 3", false, "12 pieces", 12}}, kBefore).eased);
  const auto changes = book.take({{"suspect 3", false, "2 pieces", 2}}, kBefore);
  EXPECT_TRUE(changes.eased);
  EXPECT_FALSE(changes.any()) << "nobody has to look again";
  auto after = book_from_json(book_to_json(book));
  EXPECT_THAT(after->take({{"suspect 3", false, "5 pieces", 5}}, kAfter).begun, SizeIs(1));
}

TEST(KeptAlarms, OfAnotherFormatAreNone) {
  json kept = book_to_json(AlarmBook());
  EXPECT_TRUE(book_from_json(kept).has_value());
  kept["format"] = 99;
  EXPECT_FALSE(book_from_json(kept).has_value());
  EXPECT_FALSE(book_from_json({{"format", 1}, {"last_id", 3}, {"alarms", {{{"id", "one"}}}}}).has_value());
  EXPECT_FALSE(book_from_json(json::array()).has_value());
}

// A registry, and the one after it.
class KeptTasksTest : public ::testing::Test {
 protected:
  std::unique_ptr<TaskRegistry> registry() {
    return std::make_unique<TaskRegistry>(reactor_, clock_, make_reactor_timer(reactor_), [](const TaskView&) {});
  }
  void run() {
    reactor_.restart();
    reactor_.poll();
  }
  boost::asio::io_context reactor_;
  SteadyClock clock_;
};

TEST_F(KeptTasksTest, WhatCameOfThemIsToldAfterARestart) {
  auto before = registry();
  const TaskReporter scan = before->start("scan", "scanning");
  const TaskReporter plan = before->start("plan", "matching");
  const TaskReporter other = before->start("plan", "matching");
  const TaskReporter long_one = before->start("advice", "trying");
  plan.done({{"plan", 3}});
  other.fail({ErrorCode::kRefused, "there is not enough wood"});
  long_one.done({{"best", "crop 2"}, {"shapes", std::string(kLongestKeptResult, 'x')}});
  run();
  std::vector<TaskView> views;
  for (const TaskView* task : before->list()) views.push_back(*task);
  auto kept = tasks_from_json(json::parse(tasks_to_json(before->last_id(), views).dump()));
  ASSERT_TRUE(kept.has_value());
  ASSERT_THAT(kept->unfinished, SizeIs(1));
  EXPECT_EQ(kept->unfinished[0].id, scan.id());

  auto after = registry();
  after->go_on(kept->last_id, std::move(kept->tasks));
  ASSERT_NE(after->find(scan.id()), nullptr);
  EXPECT_EQ(after->find(scan.id())->state, TaskState::kFailed);
  EXPECT_THAT(after->find(scan.id())->error->message, HasSubstr("start it again"));
  EXPECT_EQ(after->find(plan.id())->state, TaskState::kDone);
  EXPECT_EQ(json::parse(after->find(plan.id())->result->json), json({{"plan", 3}}));
  EXPECT_FALSE(after->find(plan.id())->shortened);
  EXPECT_EQ(after->find(other.id())->error->code, ErrorCode::kRefused);
  EXPECT_TRUE(after->find(long_one.id())->shortened);
  EXPECT_EQ(json::parse(after->find(long_one.id())->result->json), json({{"best", "crop 2"}}));
  EXPECT_EQ(after->start("scan", "").id(), kept->last_id + TaskRegistry::kSkipped + 1)
      << "nobody waits for a task and is told of another one";
}

TEST(KeptFile, HoldsTheNewestAndAnUnreadableOneIsNone) {
  testing::TempDirectory folder;
  KeptFile file(folder.path() / "kept.json", make_null_logger());
  EXPECT_TRUE(file.read().is_null());
  {
    Worker worker("keeper");
    for (int i = 0; i < 100; ++i) file.write(worker, [i] { return json{{"number", i}}; });
  }
  EXPECT_EQ(file.read(), json({{"number", 99}}));
  std::ofstream(folder.path() / "kept.json") << "{\"num";
  EXPECT_TRUE(file.read().is_null());
}

// What it was some days ago says nothing of today.
TEST(KeptFile, IsGoneWhenTheNewestCouldNotBeWritten) {
  testing::TempDirectory folder;
  const auto place = folder.path() / "kept.json";
  KeptFile file(place, make_null_logger());
  {
    Worker worker("keeper");
    file.write(worker, [] { return json{{"number", 1}}; });
  }
  EXPECT_FALSE(file.read().is_null());
  std::filesystem::remove(place);
  std::filesystem::create_directory(place);  // nothing can be written over a folder
  {
    Worker worker("keeper");
    file.write(worker, [] { return json{{"number", 2}}; });
  }
  EXPECT_FALSE(std::filesystem::exists(place));
}

}  // namespace
}  // namespace veneer::daemon
