// What the database refuses, whoever asks: a stray statement of ours, or somebody with the sqlite3 shell.
#include <gmock/gmock.h>

#include <map>

#include "db/leases.h"
#include "db/plans.h"
#include "tests/db/filled_cell.h"
#include "tests/db/planned_job.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

class GuardTest : public ::testing::Test {
 protected:
  void SetUp() override { fill(cell); }
  SQLite::Database& sql() { return cell.database().connection(); }
  std::vector<std::string> texts(const std::string& query) {
    std::vector<std::string> out;
    SQLite::Statement rows(sql(), query);
    while (rows.executeStep()) out.push_back(rows.getColumn(0).getString());
    return out;
  }
  std::vector<std::string> tables() {
    return texts(
        "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%' AND name NOT LIKE "
        "'allocation_boxes%' ORDER BY name");
  }
  std::vector<std::string> columns(const std::string& table) {
    return texts("SELECT name FROM pragma_table_xinfo('" + table + "') WHERE hidden = 0 ORDER BY cid");
  }
  int rows(const std::string& table) { return sql().execAndGet("SELECT count(*) FROM " + table).getInt(); }
  // What tells of nothing that was done, or goes when it is over.
  static bool may_go(const std::string& table) {
    return table == "recipes" || table == "request_keys" || table == "kept_cuts" || table == "users" ||
           table == "credentials";
  }
  // A row in the place of the one that is there.
  std::string replacement(const std::string& table, int row = 0) {
    std::string names, values;
    for (const auto& column : columns(table)) {
      names += (names.empty() ? "" : ", ") + column;
      values += (values.empty() ? "" : ", ") + column;
    }
    return fmt::format("INSERT OR REPLACE INTO {0} ({1}) SELECT {2} FROM {0} LIMIT 1 OFFSET {3}", table, names, values,
                       row);
  }

  CellDatabase cell;
};

TEST_F(GuardTest, EveryTableHasRows) {
  ASSERT_EQ(tables().size(), 59U);
  for (const auto& table : tables()) EXPECT_GT(rows(table), 0) << table;
}

TEST_F(GuardTest, NothingThatCountsIsDeleted) {
  for (const auto& table : tables()) {
    const int before = rows(table);
    const Status deleted = execute(cell.database(), "DELETE FROM " + table);
    if (may_go(table)) continue;
    EXPECT_FALSE(deleted.ok()) << table;
    EXPECT_EQ(rows(table), before) << table;
  }
}

// Not even one that may be deleted: whoever deletes says so.
TEST_F(GuardTest, NoRowTakesThePlaceOfAnother) {
  for (const auto& table : tables())
    for (int row = 0; row < rows(table); ++row)
      EXPECT_FALSE(execute(cell.database(), replacement(table, row)).ok()) << table << ", row " << row;
  // By an update too: piece 2's allocation would push out piece 1's.
  EXPECT_FALSE(execute(cell.database(), "UPDATE OR REPLACE allocations SET id = 1 WHERE id = 2").ok());
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

// Each by one of the keys that only one row may have, and by no other.
TEST_F(GuardTest, NoRowTakesThePlaceOfAnotherByASecondKey) {
  for (const char* statement :
       {"INSERT OR REPLACE INTO patches (plan, ordinal, mark, artwork_outline_um) "
        "SELECT plan, ordinal, 'other', artwork_outline_um FROM patches WHERE plan = 4 LIMIT 1",
        "INSERT OR REPLACE INTO patches (plan, ordinal, mark, artwork_outline_um) "
        "SELECT plan, 999, mark, artwork_outline_um FROM patches WHERE plan = 4 LIMIT 1",
        "INSERT OR REPLACE INTO placements (plan, patch, panel, panel_outline_um, area_um, angle_rad, shift_x_mm, "
        "shift_y_mm, improper, lead_in_um) SELECT plan, patch, panel, panel_outline_um, area_um, angle_rad, "
        "shift_x_mm, shift_y_mm, improper, lead_in_um FROM placements WHERE plan = 4 LIMIT 1",
        "UPDATE OR REPLACE request_keys SET key = 'other'", "UPDATE OR REPLACE recipes SET material = 'other'"}) {
    const Status done = execute(cell.database(), statement);
    ASSERT_FALSE(done.ok()) << statement;
    EXPECT_EQ(done.error().code, ErrorCode::kConflict) << done.error().message;
  }
}

// A row has a checksum that only this program computes. The schema and the index of wood are another matter, below.
TEST_F(GuardTest, TheShellCannotWriteARow) {
  for (const auto& table : tables()) {
    for (const auto& statement :
         {"DELETE FROM " + table, replacement(table),
          fmt::format("UPDATE {} SET {} = {}", table, columns(table).back(), columns(table).back())}) {
      const std::string answer = stray(cell.file(), statement);
      EXPECT_NE(answer, "") << statement;
    }
  }
  EXPECT_THAT(stray(cell.file(), "UPDATE allocations SET state = 'released' WHERE state = 'reserved'"),
              HasSubstr("veneer_checksum"));
  EXPECT_THAT(stray(cell.file(), "UPDATE jobs SET state = 'running'"), HasSubstr("veneer_checksum"));
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(GuardTest, TheShellCanStillRead) {
  SQLite::Database reading(cell.file().string(), SQLite::OPEN_READONLY);
  for (const auto& table : tables())
    EXPECT_GT(reading.execAndGet("SELECT count(*) FROM (SELECT * FROM " + table + ")").getInt(), 0) << table;
  EXPECT_GT(reading.execAndGet("SELECT count(*) FROM piece_states").getInt(), 0);
}

// A virtual table has no triggers, so the shell can write there: veneerd's next transaction notices that somebody
// wrote, and the check finds what.
TEST_F(GuardTest, WhatTheShellDoesToTheIndexOfWoodIsFound) {
  for (const char* statement :
       {"DELETE FROM allocation_boxes WHERE id = 1", "UPDATE allocation_boxes SET max_x = max_x - 1 WHERE id = 1",
        "INSERT INTO allocation_boxes VALUES (999, 1, 1, 0, 1, 0, 1)"}) {
    CellDatabase other;
    fill(other);
    ASSERT_EQ(stray(other.file(), statement), "");
    const Status checked = other.database().check_integrity();
    ASSERT_FALSE(checked.ok()) << statement;
    EXPECT_EQ(checked.error().code, ErrorCode::kStorage);
    EXPECT_THAT(checked.error().message, HasSubstr("index of wood"));
    { const Database closed = std::move(other.database()); }
    const auto opened = Database::open(other.file());
    ASSERT_FALSE(opened.ok()) << statement;
    EXPECT_THAT(opened.error().message, HasSubstr("index of wood"));
  }
}

// The rule that no wood is held twice looks in the index: what is missing there, it does not see.
class AfterTheShellWrote : public PlannedJob {
 protected:
  // Where the job's first piece is, and where nothing is.
  NewPlan over_a1() { return job_of({square_piece("B1", panel, 12, 12, 14)}); }
  NewPlan elsewhere() { return job_of({square_piece("B1", panel, 200, 100, 14)}); }
  template <class Answer>
  static void expect_put_off(const Answer& answer) {
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(answer.error().message, HasSubstr("has been checked, because another program wrote to it"));
    EXPECT_THAT(answer.error().message, HasSubstr(": try again in a minute"));
  }
};

TEST_F(AfterTheShellWrote, NothingIsBookedBeforeTheCheckAndARunningJobGoesOn) {
  const JobId waiting = must(jobs.create(job_of({square_piece("C1", other, 100, 100, 14)}), kNow));
  const PlanId kept = must(Plans(cell.database()).add(over_a1(), kNow));
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  ASSERT_EQ(stray(cell.file(), "DELETE FROM allocation_boxes"), "");

  expect_put_off(jobs.create(over_a1(), kLater));
  expect_put_off(jobs.create(elsewhere(), kLater));
  expect_put_off(jobs.create(kept, kLater));
  expect_put_off(Leases(cell.database()).take(kept, "local:1000", kNow, kLater));
  EXPECT_EQ(must(cell.ledger().live_allocations(panel)).size(), 3U) << "and nothing of them was booked";

  VENEER_EXPECT_OK(jobs.book_piece(pieces[1].id, kLater));
  VENEER_EXPECT_OK(jobs.mark_cutting(pieces[0].id, kLater));
  VENEER_EXPECT_OK(jobs.book_piece(pieces[0].id, kLater));
  VENEER_EXPECT_OK(jobs.make_suspect(std::vector{pieces[0].id}, kLater));
  VENEER_EXPECT_OK(jobs.finish_run(run, true, kLater));
  const RunId second = start(other);
  VENEER_EXPECT_OK(jobs.abort_run(second, {}, "the lid", kLater));
  expect_put_off(jobs.start_run(waiting, other, kPose, 0.04_mm, kLater));
  expect_put_off(jobs.redo(job, made_again({square_piece("A1", panel, 200, 100, 14)}), kLater));
  EXPECT_THAT(cell.database().check_integrity().error().message, HasSubstr("index of wood"));
  expect_put_off(jobs.create(elsewhere(), kLater));
}

TEST_F(AfterTheShellWrote, AllGoesOnOnceACheckHasFoundNothing) {
  ASSERT_EQ(stray(cell.file(), "CREATE TABLE notes (line TEXT); DROP TABLE notes"), "");
  expect_put_off(jobs.create(elsewhere(), kLater));
  VENEER_ASSERT_OK(cell.database().check_integrity());
  VENEER_EXPECT_OK(jobs.create(elsewhere(), kLater));
}

TEST_F(GuardTest, WhatTheShellDoesToTheSchemaIsFound) {
  ASSERT_EQ(stray(cell.file(), "DROP TRIGGER allocations_are_kept"), "");
  { const Database closed = std::move(cell.database()); }
  const auto opened = Database::open(cell.file());
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message, HasSubstr("trigger allocations_are_kept is not this program's"));
}

TEST_F(GuardTest, WhatIsMissingOfTheSchemaIsNamed) {
  for (const char* what : {"VIEW allocation_parts", "VIEW piece_states", "INDEX allocations_of_job"}) {
    CellDatabase other;
    fill(other);
    { const Database closed = std::move(other.database()); }
    tamper(other.file(), std::string("DROP ") + what);
    const auto opened = Database::open(other.file());
    ASSERT_FALSE(opened.ok()) << what;
    EXPECT_THAT(opened.error().message, HasSubstr("is not this program's"));
    EXPECT_THAT(opened.error().message, HasSubstr(std::string(what).substr(std::string(what).find(' ')))) << what;
  }
}

// One bit, and the column is no key any more but of another type: SQLite finds nothing wrong with a table that has no
// row yet.
TEST_F(GuardTest, AKeyOfTheIndexOfWoodThatFlippedIsFound) {
  { const Database closed = std::move(cell.database()); }
  damage_unseen(cell.file(), "\"allocation_boxes_parent\"(nodeno INTEGER PRIMARY KEY",
                "\"allocation_boxes_parent\"(nodeno INTEGER RRIMARY KEY");
  std::filesystem::remove(cell.file().string() + ".clean");
  const auto opened = Database::open(cell.file());
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("table allocation_boxes_parent is not this program's"));
}

// The words of those tables are SQLite's, and what another version of it wrote is as sound.
TEST_F(GuardTest, WhatAnotherSqliteCallsItsOwnTablesIsTheSame) {
  { const Database closed = std::move(cell.database()); }
  tamper(cell.file(),
         "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = 'CREATE TABLE ' || name || ' ( nodeno integer "
         "primary key, data )' WHERE name = 'allocation_boxes_node'; UPDATE sqlite_schema SET sql = 'CREATE TABLE "
         "sqlite_sequence( name, seq )' WHERE name = 'sqlite_sequence'");
  Database opened = must(Database::open(cell.file()));
  VENEER_EXPECT_OK(opened.check_integrity());
}

// A column that is of another type, or stands elsewhere, is found; so is a rule that SQLite's own tables do not have.
TEST_F(GuardTest, ATableOfSqlitesThatIsAnotherOneIsFound) {
  for (const char* columns :
       {"nodeno INTEGER PRIMARY KEY, data BLOB", "data, nodeno INTEGER PRIMARY KEY",
        "nodeno INTEGER PRIMARY KEY, data, more", "nodeno INTEGER PRIMARY KEY, data NOT NULL",
        "nodeno INTEGER PRIMARY KEY, date", "nodeno INTEGER PRIMARY KEY, data CHECK (data <> 1)",
        "nodeno INTEGER PRIMARY KEY REFERENCES allocation_history (id), data",
        "nodeno INTEGER PRIMARY KEY, data COLLATE NOCASE", "nodeno INTEGER PRIMARY KEY ON CONFLICT REPLACE, data",
        "nodeno INTEGER PRIMARY KEY AUTOINCREMENT, data"}) {
    CellDatabase other;
    fill(other);
    { const Database closed = std::move(other.database()); }
    tamper(other.file(), fmt::format("PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = 'CREATE TABLE "
                                     "\"allocation_boxes_node\"({})' WHERE name = 'allocation_boxes_node'",
                                     columns));
    const auto opened = Database::open(other.file());
    EXPECT_EQ(opened.ok() ? "" : what_is_damaged(other.file().string(), opened.error()),
              "its table allocation_boxes_node is not this program's")
        << columns;
  }
}

TEST_F(GuardTest, OutsideAStoresTransactionNoStatementWrites) {
  for (const auto& table : tables()) {
    EXPECT_THROW(sql().exec("DELETE FROM " + table), SQLite::Exception) << table;
    EXPECT_THROW(sql().exec(replacement(table)), SQLite::Exception) << table;
  }
  EXPECT_THROW(sql().exec("UPDATE allocations SET state = 'released' WHERE state = 'reserved'"), SQLite::Exception);
  // The same as a store would do it.
  VENEER_EXPECT_OK(execute(cell.database(), "UPDATE allocations SET state = 'released' WHERE state = 'reserved'"));
}

TEST_F(GuardTest, TheIndexOfWoodIsWrittenByTheLedgersTriggersOnly) {
  for (const char* statement :
       {"DELETE FROM allocation_boxes", "UPDATE allocation_boxes SET max_x = 0", "DELETE FROM allocation_boxes_node",
        "INSERT INTO allocation_boxes VALUES (999, 1, 1, 0, 1, 0, 1)", "UPDATE allocation_boxes_rowid SET nodeno = 9"})
    EXPECT_FALSE(execute(cell.database(), statement).ok()) << statement;
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(GuardTest, WhatProtectsTheRowsCannotBeTakenAway) {
  for (const char* statement :
       {"DROP TRIGGER allocations_are_kept", "DROP TABLE audit", "PRAGMA recursive_triggers = OFF",
        "PRAGMA foreign_keys = OFF", "PRAGMA writable_schema = ON", "PRAGMA ignore_check_constraints = ON",
        "ATTACH ':memory:' AS other", "CREATE TRIGGER t AFTER INSERT ON audit BEGIN SELECT 1; END",
        "ALTER TABLE audit RENAME TO gone", "PRAGMA user_version = 1", "DELETE FROM sqlite_sequence", "VACUUM",
        "UPDATE sqlite_schema SET sql = ''"}) {
    EXPECT_THROW(sql().exec(statement), SQLite::Exception) << statement;
    EXPECT_FALSE(execute(cell.database(), statement).ok()) << statement;
  }
  EXPECT_EQ(sql().execAndGet("PRAGMA recursive_triggers").getInt(), 1);
  EXPECT_EQ(sql().execAndGet("PRAGMA foreign_keys").getInt(), 1);
}

TEST_F(GuardTest, ATriggerThatWasDroppedIsFoundAtTheNextStart) {
  const auto file = cell.file();
  { const Database closed = std::move(cell.database()); }
  tamper(file,
         "DROP TRIGGER allocations_are_kept; DROP TRIGGER allocation_history_is_kept;"
         "DELETE FROM allocation_history WHERE allocation = 1; DELETE FROM allocations WHERE id = 1");
  const auto opened = Database::open(file);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("trigger allocation_history_is_kept is not this program's"));
}

TEST_F(GuardTest, AReaderWritesNothingEither) {
  Database reading = must(Database::open_for_reading(cell.file()));
  EXPECT_THROW(reading.connection().exec("DELETE FROM audit"), SQLite::Exception);
  VENEER_EXPECT_OK(reading.check_integrity());
}

TEST_F(GuardTest, PlansWithoutJobsCanGoOthersStay) {
  Plans plans(cell.database());
  EXPECT_EQ(plans.remove({1}).error().code, ErrorCode::kConflict);
  EXPECT_EQ(plans.remove({2}).error().code, ErrorCode::kConflict) << "by which a piece was made again";
  VENEER_EXPECT_OK(plans.remove({4}));
  EXPECT_EQ(plans.remove({4}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(plans.remove({5}).error().code, ErrorCode::kConflict) << "which leases its wood";
  EXPECT_FALSE(execute(cell.database(), "DELETE FROM placements WHERE plan = 5").ok());
  EXPECT_EQ(rows("plans"), 4);
}

}  // namespace
}  // namespace veneer::db
