// Backups as the API's clients ask for them.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <thread>

#include "base/clock.h"
#include "base/files.h"
#include "daemon/records/backup_disk.h"
#include "daemon/store/backup.h"
#include "db/audit.h"
#include "tests/support/hanging_file.h"
#include "tests/support/json_schema.h"
#include "tests/support/routed_cell.h"
#include "tests/support/stocked_database.h"
#include "tests/support/task_json.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kRow = "what the disk will change";

class BackupRoutes : public testing::RoutedCell {
 protected:
  BackupRoutes()
      : RoutedCell([](const std::filesystem::path& data_dir) {
          auto database = db::Database::open(data_dir / kDatabaseName);
          if (!database || !db::Audit(*database).append({0, tests::kThen, "test", "fill", kRow}))
            throw std::runtime_error("the database cannot be filled");
        }) {}
};

TEST_F(BackupRoutes, ABackupIsATaskAndIsListedAndAudited) {
  ASSERT_TRUE(tests::stock_two_panels(*cell->database, 3, 2).ok());
  const TaskView done = ended(ask("POST", "/api/v1/backups"));
  ASSERT_EQ(done.state, TaskState::kDone) << done.error.value_or(Error{}).message;
  EXPECT_EQ(done.progress, 1);
  EXPECT_THAT(testing::openapi_errors(testing::json_of(done)["result"], "/components/schemas/Backup"), IsEmpty());
  const json list = body_of(ask("GET", "/api/v1/backups"));
  ASSERT_EQ(list["backups"].size(), 1U);
  const json& listed = list["backups"][0];
  EXPECT_EQ(list["folder"], (config.store.data_dir / "backups").string());
  EXPECT_EQ(listed["folder"], testing::json_of(done)["result"]["folder"]);
  EXPECT_EQ(listed["panels"], 2);
  EXPECT_EQ(listed["jobs"], 1);
  EXPECT_EQ(listed["pieces"], 5);
  EXPECT_GT(listed["bytes"].get<int>(), 10'000);
  EXPECT_TRUE(check_backup(listed["folder"].get<std::string>(), {}, [](double, const std::string&) {}).ok());
  ASSERT_TRUE(cell->database->call([](Repositories& r) { return r.audit.head(); }).ok()) << "the last row is written";
  const json all = body_of(ask("GET", "/api/v1/audit?limit=9"))["entries"];
  json audit = json::array();  // an alarm may be among them
  for (const json& entry : all)
    if (entry["who"] == "uid 1000") audit.push_back(entry);
  ASSERT_GE(audit.size(), 2U);
  EXPECT_EQ(audit[1]["what"], "api.makeBackup");
  EXPECT_EQ(audit[1]["who"], "uid 1000");
  EXPECT_EQ(audit[0]["what"], "api.makeBackup.done");
  EXPECT_EQ(audit[0]["who"], "uid 1000");
  EXPECT_EQ(json::parse(audit[0].value("detail", ""), nullptr, false)["folder"], listed["folder"]);
}

TEST_F(BackupRoutes, WhatIsAskedTwiceUnderOneKeyIsMadeOnce) {
  idempotency_key = "nightly-1";
  const ApiReply first = ask("POST", "/api/v1/backups");
  ended(first);
  EXPECT_EQ(ask("POST", "/api/v1/backups").body, first.body);
  EXPECT_EQ(body_of(ask("GET", "/api/v1/backups"))["backups"].size(), 1U);
}

TEST_F(BackupRoutes, OneAtATime) {
  ASSERT_TRUE(cell->backups->make(cell->tasks).ok());
  const auto second = cell->backups->make(cell->tasks);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kConflict);
}

TEST_F(BackupRoutes, TheEndOfTheDaemonDoesNotWaitForOneAndLeavesNothingHalf) {
  ASSERT_TRUE(cell->backups->make(cell->tasks).ok());
  cell.reset();
  for (const auto& entry : std::filesystem::directory_iterator(config.store.data_dir / "backups"))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

TEST_F(BackupRoutes, AFolderThatCannotBeWrittenFailsTheTaskInOneSentence) {
  std::ofstream(config.store.data_dir / "backups") << "in the way";
  const TaskView failed = ended(ask("POST", "/api/v1/backups"));
  EXPECT_EQ(failed.state, TaskState::kFailed);
  ASSERT_TRUE(failed.error);
  EXPECT_EQ(failed.error->code, ErrorCode::kStorage);
  EXPECT_THAT(failed.error->message, HasSubstr("backup_dir"));
  // On the thread that writes, behind what was to be written; the alarm's row may have come as well.
  const auto noted = cell->database->call([](Repositories& r) { return r.audit.latest(5); });
  ASSERT_TRUE(noted.ok());
  const auto row = std::ranges::find(*noted, std::string("api.makeBackup.failed"), &db::AuditEntry::what);
  ASSERT_NE(row, noted->end());
  EXPECT_EQ(row->detail, failed.error->message);
  EXPECT_EQ(ended(ask("POST", "/api/v1/backups")).state, TaskState::kFailed) << "and it can be asked for again";
}

// The disk has changed a row that nobody has read since: the copy's check finds it, and the whole file is read then.
TEST_F(BackupRoutes, ADamagedDatabaseGetsNoBackupAndIsFoundOut) {
  const auto file = config.store.data_dir / kDatabaseName;
  {
    std::fstream raw(file, std::ios::in | std::ios::out | std::ios::binary);
    const std::string bytes = read_whole(file).value_or("");
    const auto at = bytes.find(kRow);
    ASSERT_NE(at, std::string::npos);
    raw.seekp(static_cast<std::streamoff>(at));
    raw << "W";
  }
  const TaskView failed = ended(ask("POST", "/api/v1/backups"));
  EXPECT_EQ(failed.state, TaskState::kFailed);
  ASSERT_TRUE(failed.error);
  EXPECT_THAT(failed.error->message, HasSubstr("did not pass its check"));
  EXPECT_THAT(failed.error->message, HasSubstr("audit"));
  EXPECT_THAT(body_of(ask("GET", "/api/v1/backups"))["backups"], IsEmpty());
  while (cell->integrity->state() != DatabaseCheck::State::kDamaged) {
    reactor.restart();
    ASSERT_GT(reactor.run_one_for(std::chrono::seconds(10)), 0U) << cell->integrity->to_json();
  }
}

// The disk of the backups hangs when the cell looks for the newest one.
struct Hanging {
  std::optional<testing::HangingFile> hanging;
};
class HangingBackups : protected Hanging, public testing::RoutedCell {
 protected:
  HangingBackups()
      : RoutedCell([this](const std::filesystem::path& data_dir) {
          const auto backup = data_dir / "backups" / "2026-05-01T07-30-00.000Z";
          std::filesystem::create_directories(backup);
          hanging.emplace(backup / kManifestName);
        }) {}
};

TEST_F(HangingBackups, HoldUpNothingElse) {
  const auto first = begin_asking("GET", "/api/v1/backups"), second = begin_asking("GET", "/api/v1/backups");
  EXPECT_EQ(ask("GET", "/api/v1/panels").status, 200);
  EXPECT_EQ(ended(ask("POST", "/api/v1/integrity-check")).state, TaskState::kDone);
  const auto kept = config.store.data_dir / kTasksName;
  while (read_whole(kept).value_or("").find("integrity check") == std::string::npos) std::this_thread::yield();
  EXPECT_FALSE(*first || *second);
  hanging->let_go();
  while (!*first || !*second) {
    reactor.restart();
    reactor.run_one_for(std::chrono::seconds(10));
  }
  EXPECT_EQ((*first)->status, 200);
  EXPECT_THAT(body_of(**second)["backups"][0]["fault"].get<std::string>(), HasSubstr("is damaged"));
}

TEST_F(HangingBackups, TheEndOfTheDaemonDoesNotWaitForThem) {
  cell.reset();
  hanging->let_go();
}

TEST_F(HangingBackups, AreToldOfAfterAMinuteUntilTheyAnswer) {
  ManualClock minutes;
  BackupDisk disk(config.store.data_dir / "backups", minutes);
  disk.look();
  EXPECT_EQ(disk.silence(), "") << "it may have to wake up";
  minutes.advance(BackupDisk::kSilent);
  EXPECT_THAT(disk.silence(), HasSubstr("does not answer, and no backup is made before it does: see that"));
  disk.look();
  EXPECT_THAT(disk.silence(), HasSubstr("does not answer")) << "it was not asked once more";
  EXPECT_FALSE(disk.seen());
  hanging->let_go();
  while (!disk.seen()) std::this_thread::yield();
  EXPECT_EQ(disk.silence(), "");
  EXPECT_FALSE(disk.seen()->newest_at) << "nobody can read that one";
}

}  // namespace
}  // namespace veneer::daemon
