#include "db/database.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "db/audit.h"
#include "db/migrations.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

TEST(Database, StartsWithTheNewestSchemaAndIsSound) {
  CellDatabase cell;
  EXPECT_EQ(cell.database().schema_version(), migrations().back().version);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST(Database, MakesItsFolder) {
  const testing::TempDirectory directory;
  VENEER_EXPECT_OK(Database::open(directory / "state" / "cell" / "veneerd.db"));
}

TEST(Database, RunsInWalModeAndSyncsFully) {
  CellDatabase cell;
  auto& connection = cell.database().connection();
  EXPECT_EQ(connection.execAndGet("PRAGMA journal_mode").getString(), "wal");
  EXPECT_EQ(connection.execAndGet("PRAGMA synchronous").getInt(), 2);
  EXPECT_EQ(connection.execAndGet("PRAGMA foreign_keys").getInt(), 1);
}

TEST(Database, RefusesASecondWriterUntilTheFirstIsGone) {
  CellDatabase cell;
  const auto second = Database::open(cell.file());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(second.error().message, HasSubstr("another veneerd is running"));
  cell.reopen();
}

TEST(Database, RefusesAFileThatIsNoDatabase) {
  const testing::TempDirectory directory;
  std::ofstream(directory / "veneerd.db") << std::string(8192, 'x');
  const auto opened = Database::open(directory / "veneerd.db");
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("is damaged"));
  EXPECT_THAT(opened.error().message, HasSubstr("veneerd.db"));
}

TEST(Database, RefusesADatabaseOfAnotherProgramAndLeavesItAlone) {
  const testing::TempDirectory directory;
  const std::string file = (directory / "other.db").string();
  SQLite::Database(file, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec("CREATE TABLE songs (title TEXT)");
  const auto opened = Database::open(file);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(opened.error().message, HasSubstr("another program"));
  SQLite::Database again(file);
  EXPECT_EQ(again.execAndGet("SELECT count(*) FROM sqlite_schema").getInt(), 1);
  EXPECT_NE(again.execAndGet("PRAGMA journal_mode").getString(), "wal");
}

TEST(Database, RefusesANewerSchema) {
  const testing::TempDirectory directory;
  const std::string file = (directory / "veneerd.db").string();
  must(Database::open(file));
  SQLite::Database(file, SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  const auto writer = Database::open(file);
  ASSERT_FALSE(writer.ok());
  EXPECT_EQ(writer.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(writer.error().message, HasSubstr("has schema 99"));
  const auto reader = Database::open_for_reading(file);
  ASSERT_FALSE(reader.ok());
  EXPECT_THAT(reader.error().message, HasSubstr("has schema 99"));
}

TEST(Database, SaysWhenPagesAreDamaged) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  {
    Database database = must(Database::open(file));
    for (int i = 0; i < 200; ++i)
      VENEER_ASSERT_OK(Audit(database).append({0, kNow, "test", "fill", std::string(300, 'x')}));
  }
  const auto size = std::filesystem::file_size(file);
  std::fstream raw(file, std::ios::in | std::ios::out | std::ios::binary);
  for (std::uintmax_t at = size / 2; at < size; at += 512) {
    raw.seekp(static_cast<std::streamoff>(at));
    raw << "the disk was not well";
  }
  raw.close();
  const auto opened = Database::open(file);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("is damaged"));
}

// As after a kill: nobody left the mark of a clean end.
std::filesystem::path left_uncleanly(const testing::TempDirectory& directory) {
  const auto file = directory / "veneerd.db";
  {
    Database database = must(Database::open(file));
    for (int i = 0; i < 200; ++i)
      VENEER_EXPECT_OK(Audit(database).append({0, kNow, "test", "fill", std::string(300, 'x')}));
  }
  std::filesystem::remove(file.string() + ".clean");
  return file;
}

TEST(Database, OpenedUncheckedItIsReadAtOnceAndWrittenOnlyAfterItsCheck) {
  const testing::TempDirectory directory;
  Database database = must(Database::open_unchecked(left_uncleanly(directory)));
  EXPECT_TRUE(database.needs_check());
  EXPECT_EQ(must(Audit(database).latest(1)).size(), 1U);
  const Status early = Audit(database).append({0, kNow, "test", "early", ""});
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(early.error().message, HasSubstr("before it has passed its check"));
  VENEER_ASSERT_OK(database.check_integrity());
  EXPECT_FALSE(database.needs_check());
  VENEER_EXPECT_OK(Audit(database).append({0, kNow, "test", "now", ""}));
}

TEST(Database, ThatNobodyCheckedIsNotMarkedAsCleanWhenItIsClosed) {
  const testing::TempDirectory directory;
  const auto file = left_uncleanly(directory);
  must(Database::open_unchecked(file));
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".clean"));
  EXPECT_TRUE(must(Database::open_unchecked(file)).needs_check());
  must(Database::open(file));
  EXPECT_FALSE(must(Database::open_unchecked(file)).needs_check()) << "checked, and closed in order";
}

TEST(Database, ACheckThatIsStoppedSaysSoAndProvesNothing) {
  const testing::TempDirectory directory;
  Database database = must(Database::open_unchecked(left_uncleanly(directory)));
  std::stop_source stop;
  stop.request_stop();
  const Status stopped = database.check_integrity(stop.get_token());
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(database.needs_check());
  VENEER_EXPECT_OK(database.check_integrity());
}

bool needs_check_next_time(CellDatabase& cell) {
  { const Database closed = std::move(cell.database()); }
  cell.database() = must(Database::open_unchecked(cell.file()));
  return cell.database().needs_check();
}

TEST(Database, ThatAnotherProgramWroteToIsCheckedAtTheNextStart) {
  for (const bool written_since : {false, true}) {
    CellDatabase cell;
    ASSERT_EQ(stray(cell.file(), "CREATE TABLE notes (line TEXT); DROP TABLE notes"), "");
    if (written_since) VENEER_EXPECT_OK(Audit(cell.database()).append({0, kNow, "test", "write", ""}));
    EXPECT_TRUE(needs_check_next_time(cell));
  }
}

TEST(Database, ThatAnotherProgramReadOrWasRefusedIsClean) {
  CellDatabase cell;
  VENEER_ASSERT_OK(Audit(cell.database()).append({0, kNow, "test", "write", ""}));
  EXPECT_NE(stray(cell.file(), "DELETE FROM audit"), "");
  EXPECT_EQ(stray(cell.file(), "SELECT count(*) FROM audit"), "");
  Database reading = must(Database::open_for_reading(cell.file()));
  EXPECT_EQ(must(Audit(reading).latest(1)).size(), 1U);
  EXPECT_FALSE(needs_check_next_time(cell));
}

// A backup that is put in its place while it is in use: what is written goes to a file that nobody will find again.
TEST(Database, WritesNothingOnceAnotherFileIsInItsPlace) {
  CellDatabase cell;
  const auto backup = cell.file().string() + ".backup";
  tamper(cell.file(), "VACUUM INTO '" + backup + "'");
  std::filesystem::rename(backup, cell.file());
  const Status written = Audit(cell.database()).append({0, kNow, "test", "write", ""});
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kStorage);
  EXPECT_THAT(written.error().message, HasSubstr("stop veneerd"));
  EXPECT_TRUE(needs_check_next_time(cell)) << "nobody has checked the file that is there now";
}

TEST(Database, SaysWhenItsFolderCannotBeWritten) {
  const auto opened = Database::open("/proc/veneer/veneerd.db");
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("/proc/veneer/veneerd.db"));
}

TEST(Database, ReadersSeeTheLastCommitWhileTheWriterGoesOn) {
  CellDatabase cell;
  Audit audit(cell.database());
  VENEER_ASSERT_OK(audit.append({0, kNow, "test", "first", ""}));
  std::vector<std::thread> readers;
  std::vector<int> seen(4, 0);
  std::vector<int> broken(4, 0);
  for (std::size_t r = 0; r < seen.size(); ++r)
    readers.emplace_back([&, r] {
      Database reading = must(Database::open_for_reading(cell.file()));
      for (int i = 0; i < 50; ++i) {
        const auto entries = must(Audit(reading).latest(1000));
        if (entries.size() < static_cast<std::size_t>(seen[r])) ++broken[r];
        seen[r] = static_cast<int>(entries.size());
      }
    });
  for (int i = 0; i < 100; ++i) VENEER_EXPECT_OK(audit.append({0, kNow, "test", "next", ""}));
  for (auto& reader : readers) reader.join();
  EXPECT_THAT(broken, ::testing::Each(0));
  EXPECT_THAT(seen, ::testing::Each(::testing::Ge(1)));
}

TEST(Database, WhatIsReadAtOneMomentAgreesWhileTheWriterGoesOn) {
  CellDatabase cell;
  Audit audit(cell.database());
  Database reading = must(Database::open_for_reading(cell.file()));
  const auto entries = [&] { return must(Audit(reading).latest(10)).size(); };
  const auto before = at_one_moment(reading, [&]() -> Result<std::size_t> {
    EXPECT_EQ(entries(), 0U);
    VENEER_EXPECT_OK(audit.append({0, kNow, "test", "next", ""}));
    // The inner one is a part of the outer one, and does not end it.
    const auto inner = at_one_moment(reading, [&]() -> Result<std::size_t> { return entries(); });
    EXPECT_EQ(must(inner), 0U);
    return entries();
  });
  EXPECT_EQ(must(before), 0U);
  EXPECT_EQ(entries(), 1U);
}

// A check on demand reads with a connection of its own while the cell goes on.
TEST(Database, ACheckFindsASoundFileSoundWhileTheWriterGoesOn) {
  CellDatabase cell;
  Audit audit(cell.database());
  std::atomic<bool> checked = false;
  std::jthread checking([&] {
    Database reading = must(Database::open_for_reading(cell.file()));
    for (int i = 0; i < 20; ++i) VENEER_EXPECT_OK(reading.check_integrity());
    checked = true;
  });
  while (!checked) VENEER_EXPECT_OK(audit.append({0, kNow, "test", "next", ""}));
}

TEST(Database, AReaderCannotWrite) {
  CellDatabase cell;
  Database reading = must(Database::open_for_reading(cell.file()));
  const Status written = Audit(reading).append({0, kNow, "test", "write", ""});
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kStorage);
}

TEST(Database, AReaderAsksForTheFileByName) {
  const auto opened = Database::open_for_reading("/nowhere/veneerd.db");
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
}

TEST(Migrations, RunInOrderAndOnlyOnce) {
  SQLite::Database connection(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  const Migration steps[] = {{1, "0001_a", "CREATE TABLE a (x INTEGER) STRICT"},
                             {2, "0002_b", "ALTER TABLE a ADD COLUMN y INTEGER; INSERT INTO a VALUES (1, 2)"}};
  VENEER_ASSERT_OK(migrate(connection, std::span(steps).first(1)));
  EXPECT_EQ(connection.execAndGet("PRAGMA user_version").getInt(), 1);
  VENEER_ASSERT_OK(migrate(connection, steps));
  VENEER_ASSERT_OK(migrate(connection, steps));
  EXPECT_EQ(connection.execAndGet("PRAGMA user_version").getInt(), 2);
  EXPECT_EQ(connection.execAndGet("SELECT count(*) FROM a").getInt(), 1);
}

TEST(Migrations, AStepThatFailsLeavesTheVersionBeforeIt) {
  SQLite::Database connection(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  const Migration steps[] = {{1, "0001_a", "CREATE TABLE a (x INTEGER) STRICT"},
                             {2, "0002_b", "INSERT INTO a VALUES (1); INSERT INTO nowhere VALUES (2)"}};
  const Status migrated = migrate(connection, steps);
  ASSERT_FALSE(migrated.ok());
  EXPECT_THAT(migrated.error().message, HasSubstr("0002_b"));
  EXPECT_EQ(connection.execAndGet("PRAGMA user_version").getInt(), 1);
  EXPECT_EQ(connection.execAndGet("SELECT count(*) FROM a").getInt(), 0);
}

TEST(Migrations, AreNumberedFromOneWithoutGaps) {
  int expected = 0;
  for (const Migration& step : migrations()) {
    EXPECT_EQ(step.version, ++expected);
    EXPECT_THAT(step.name, ::testing::StartsWith(fmt::format("{:04d}_", step.version)));
  }
}

TEST(Audit, IsAppendOnly) {
  CellDatabase cell;
  Audit audit(cell.database());
  VENEER_ASSERT_OK(audit.append({0, kNow, "local:1000", "job.start", "job 1"}));
  VENEER_ASSERT_OK(audit.append({0, kLater, "console", "stop", ""}));
  EXPECT_FALSE(execute(cell.database(), "DELETE FROM audit").ok());
  EXPECT_FALSE(execute(cell.database(), "UPDATE audit SET who = 'nobody'").ok());
  const auto entries = must(audit.latest(10));
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].what, "stop");
  EXPECT_EQ(entries[1].who, "local:1000");
  EXPECT_EQ(must(audit.latest(1)).size(), 1U);
}

}  // namespace
}  // namespace veneer::db
