// A data folder made of a backup: what counts again, what is kept aside, and what is refused.

#include "daemon/store/restore.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include "base/archive.h"
#include "db/accounts.h"
#include "db/job_store.h"
#include "tests/daemon/store/backup_fixture.h"

namespace veneer::daemon {
namespace {

using db::must;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Optional;

// On another machine: nothing is there but the backup.
TEST_F(Backup, BecomesACellInAnEmptyFolder) {
  const fs::path backup = must(make()).folder;
  const fs::path elsewhere = directory / "elsewhere" / "veneerd";
  const Restored restored = must(restore(backup, elsewhere));
  EXPECT_EQ(restored.aside, "");
  EXPECT_EQ(restored.placed, 2U);
  EXPECT_EQ(panels_in(elsewhere / kDatabaseName), 1U);
  EXPECT_EQ(bytes_of(elsewhere / last_map), bytes_of(data / last_map));
  EXPECT_THAT(describe(restored), HasSubstr("1 panels"));
}

// Whoever plans the picture again, or saves the drawing, needs it.
TEST_F(Backup, BringsTheDrawingThatALayoutWasMadeOf) {
  const std::string drawing = "<svg/>", file = fmt::format("drawings/d-{}", hash_of(drawing).substr(0, 16));
  write(data / file, drawing);
  db::NewPlan plan = db::job_of({});
  plan.options_json = json{{"segmentation_bytes", 6}, {"segmentation_file", file}}.dump();
  const db::PlanId drawn = must(db::Plans(*database).add(plan, db::kNow));
  const fs::path backup = must(make()).folder, elsewhere = directory / "elsewhere";
  fs::remove(data / file);
  must(restore(backup, elsewhere));
  EXPECT_EQ(bytes_of(elsewhere / file), drawing);
  db::Database opened = must(db::Database::open(elsewhere / kDatabaseName));
  const json options = json::parse(must(db::Plans(opened).find(drawn)).options_json);
  EXPECT_EQ(options["segmentation_file"], file);
}

TEST_F(Backup, AsOneFileBecomesACellToo) {
  const fs::path backup = must(make()).folder, file = directory / "cell.tar.zst", elsewhere = directory / "elsewhere";
  VENEER_ASSERT_OK(pack_folder(backup, file, [](double) {}));
  write(elsewhere / ".unpacking" / "left", "by one that was killed");
  const Restored restored = must(restore(file, elsewhere));
  EXPECT_EQ(restored.placed, 2U);
  EXPECT_EQ(bytes_of(elsewhere / last_map), bytes_of(data / last_map));
  EXPECT_FALSE(fs::exists(elsewhere / ".unpacking"));
  EXPECT_THAT(describe(restored), HasSubstr("cell.tar.zst"));
  db::Database opened = must(db::Database::open(elsewhere / kDatabaseName));
  const auto noted = must(db::Audit(opened).latest(1));
  EXPECT_EQ(noted.at(0).who + " " + noted.at(0).what, "uid 1000 store.restore");
  EXPECT_THAT(noted.at(0).detail, HasSubstr("cell.tar.zst, made 2026-05-01T07:30:"));
}

TEST_F(Backup, AsOneFileThatIsDamagedOrNoBackupTouchesNothing) {
  const fs::path backup = must(make()).folder, file = directory / "cell.tar", elsewhere = directory / "elsewhere";
  VENEER_ASSERT_OK(pack_folder(backup, file, [](double) {}));
  fs::resize_file(file, fs::file_size(file) / 2);
  const auto cut = restore(file, elsewhere);
  ASSERT_FALSE(cut.ok());
  EXPECT_THAT(cut.error().message, HasSubstr("is damaged"));
  VENEER_ASSERT_OK(pack_folder(data / "panels", directory / "pictures.tar", [](double) {}));
  const auto other = restore(directory / "pictures.tar", elsewhere);
  ASSERT_FALSE(other.ok());
  EXPECT_THAT(other.error().message, HasSubstr("holds no backup"));
  EXPECT_FALSE(fs::exists(elsewhere / kDatabaseName));
  EXPECT_FALSE(fs::exists(elsewhere / ".unpacking"));
}

TEST_F(Backup, TakesThePlaceOfADatabaseThatIsKept) {
  const std::string first_map = last_map;
  const fs::path backup = must(make()).folder;
  add_panel();
  database.reset();
  flip(data / kDatabaseName);
  flip(data / first_map);
  for (const char* name : {kAlarmsName, kTasksName}) write(data / name, "[{}]");
  const std::string damaged_database = bytes_of(data / kDatabaseName), damaged_map = bytes_of(data / first_map);
  const Restored restored = must(restore(backup, data));
  EXPECT_EQ(restored.placed, 1U);
  EXPECT_EQ(bytes_of(restored.aside / kDatabaseName), damaged_database);
  EXPECT_EQ(bytes_of(restored.aside / first_map), damaged_map);
  EXPECT_EQ(bytes_of(data / first_map), bytes_of(backup / first_map));
  for (const char* name : {kAlarmsName, kTasksName}) {
    EXPECT_EQ(bytes_of(restored.aside / name), "[{}]");
    EXPECT_FALSE(fs::exists(data / name)) << "it tells of jobs that are others now";
  }
  EXPECT_TRUE(fs::exists(data / last_map)) << "a picture that the backup does not know stays";
  EXPECT_EQ(panels_in(data / kDatabaseName), 1U);
}

// The marks of a restore are on the disk before it counts: a copy that does not take them takes no place.
TEST_F(Backup, ThatCannotBeMarkedDoesNotCount) {
  const fs::path backup = must(make()).folder;
  add_panel();
  database.reset();
  EXPECT_FALSE(is_marked(data / kDatabaseName));
  write(data / "veneerd.db.restoring-wal" / "in", "the way of a log");
  EXPECT_FALSE(restore(backup, data).ok());
  fs::remove_all(data / "veneerd.db.restoring-wal");
  EXPECT_EQ(panels_in(data / kDatabaseName), 2U);
  EXPECT_FALSE(is_marked(data / kDatabaseName));
  for (const auto& [name, bytes] : tree(data)) EXPECT_THAT(name, Not(HasSubstr("restor")));
  must(restore_backup({backup, data, "uid 1000", "2026-05-03T07:30:00.000Z", true}, quiet));
  db::Database opened = must(db::Database::open(data / kDatabaseName));
  VENEER_EXPECT_OK(db::Panels(opened).check_seen({"P-0001"}));
  EXPECT_THAT(must(db::Audit(opened).latest(1)).at(0).detail, HasSubstr("nothing was cut since"));
}

// A token may have been revoked after the backup was made: it must not open anything again.
TEST_F(Backup, BringsAccountsBackAndSignsNobodyIn) {
  db::Accounts accounts(*database);
  VENEER_EXPECT_OK(accounts.add(db::UserRecord{"anna", "operator", "$argon2id$v=19$x", "t", "t"}));
  VENEER_EXPECT_OK(
      accounts.add(db::CredentialRecord{std::string(64, 'a'), "token", "anna", "press room", "operator", "t", "t"}));
  const fs::path backup = must(make()).folder;
  VENEER_EXPECT_OK(accounts.end_all());
  database.reset();
  must(restore(backup, data));
  db::Database opened = must(db::Database::open(data / kDatabaseName));
  EXPECT_EQ(must(db::Accounts(opened).users()).size(), 1U);
  EXPECT_TRUE(must(db::Accounts(opened).credentials()).empty());
}

// What was calibrated since is lost with the rest, and the certificates before count again.
TEST_F(Backup, SaysWhichCalibrationsCountAgain) {
  db::Certificates certificates(*database);
  for (const char* day : {"2026-03-01", "2026-04-01"})
    must(certificates.issue({{},
                             db::CertificateKind::kKerf,
                             std::string(day) + "T07:30:00.000Z",
                             "2027-01-01T00:00:00.000Z",
                             Millimetres(0.02),
                             "{}"}));
  const fs::path backup = must(make()).folder;
  must(certificates.issue({{},
                           db::CertificateKind::kKerf,
                           "2026-05-01T09:00:00.000Z",
                           "2027-01-01T00:00:00.000Z",
                           Millimetres(0.02),
                           "{}"}));
  database.reset();
  EXPECT_THAT(describe(must(restore(backup, data))),
              HasSubstr("These calibrations count now: kerf of 2026-04-01. Calibrate again what was calibrated since "
                        "2026-05-01: that is not in the backup.\n"));
}

// Who was removed since is back, and somebody has to know.
TEST_F(Backup, SaysWhoMaySignInAgain) {
  db::Accounts accounts(*database);
  VENEER_ASSERT_OK(accounts.add(
      db::UserRecord{"anna", "admin", "$argon2id$v=19$x", "2026-04-01T07:30:00.000Z", "2026-04-01T07:30:00.000Z"}));
  const fs::path backup = must(make()).folder;
  VENEER_ASSERT_OK(accounts.remove("anna"));
  database.reset();
  EXPECT_THAT(describe(must(restore(backup, data))),
              HasSubstr("These may sign in again, with the passwords of 2026-05-01: anna (admin). Remove whom you "
                        "removed since; sessions and tokens have ended.\n"));
}

// A backup is no way round Clear.
class BackupAfterAnAbort : public Backup {
 protected:
  // Why Clear is owed once the backup is in place, as the next start finds it.
  std::optional<std::string> owed_after(const fs::path& backup, bool nothing_cut_since = false) {
    const std::string at = fmt::format("2026-05-03T07:30:{:02}.000Z", second++);
    restored = describe(must(restore_backup({backup, data, "uid 1000", at, nothing_cut_since}, quiet)));
    db::Database opened = must(db::Database::open(data / kDatabaseName));
    return must(db::JobStore(opened).recover(db::kLater)).clear_owed;
  }
  std::string restored;
};

TEST_F(BackupAfterAnAbort, IsToBeClearedAsBefore) {
  const fs::path backup = must(make()).folder;
  db::JobStore jobs(*database);
  VENEER_ASSERT_OK(jobs.note_abort("STOP by anna", db::kNow));
  database.reset();
  for (const bool nothing_cut_since : {true, false}) {
    EXPECT_THAT(owed_after(backup, nothing_cut_since), Optional(HasSubstr("STOP by anna")));
    EXPECT_THAT(restored, HasSubstr("veneerd will start Aborted (before a backup was put in place:"));
  }
}

TEST_F(BackupAfterAnAbort, IsToBeClearedOfWhatNoStartHasFoundYet) {
  const fs::path backup = must(make()).folder;
  VENEER_ASSERT_OK(db::JobStore(*database).note_under_way("while the head was jogged", db::kNow));
  database.reset();  // killed
  EXPECT_THAT(owed_after(backup), Optional(HasSubstr("the program ended while the head was jogged")));
}

TEST_F(BackupAfterAnAbort, IsToBeClearedOfWhatCannotBeRead) {
  const fs::path backup = must(make()).folder;
  database.reset();
  // A flipped bit may lie where nothing is written.
  fs::resize_file(data / kDatabaseName, fs::file_size(data / kDatabaseName) / 2);
  EXPECT_THAT(owed_after(backup, true), Optional(HasSubstr("could not be read")));
  fs::remove(data / kDatabaseName);
  EXPECT_THAT(owed_after(backup), Optional(HasSubstr("could not be read")));
}

TEST_F(BackupAfterAnAbort, OwesNothingThatWasCleared) {
  const fs::path backup = must(make()).folder;
  db::JobStore jobs(*database);
  VENEER_ASSERT_OK(jobs.note_abort("STOP by anna", db::kNow));
  VENEER_ASSERT_OK(jobs.note_cleared("anna", db::kNow));
  database.reset();
  EXPECT_EQ(owed_after(backup), std::nullopt);
  EXPECT_THAT(restored, Not(HasSubstr("Aborted")));
}

// A daemon that was killed leaves a log, which belongs to the old database and must not reach the new one.
TEST_F(Backup, IsNotMixedWithTheLogOfTheOldDatabase) {
  const fs::path backup = must(make()).folder;
  add_panel();
  const std::string log = bytes_of(data / "veneerd.db-wal"), file = bytes_of(data / kDatabaseName);
  ASSERT_FALSE(log.empty());
  database.reset();
  write(data / kDatabaseName, file);
  write(data / "veneerd.db-wal", log);
  const Restored restored = must(restore(backup, data));
  EXPECT_EQ(panels_in(data / kDatabaseName), 1U);
  EXPECT_EQ(panels_in(restored.aside / kDatabaseName), 2U);
}

TEST_F(Backup, IsNotRestoredUnderARunningDaemon) {
  const fs::path backup = must(make()).folder;
  add_panel();
  const auto before = tree(data);
  const auto refused = restore(backup, data);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.error().message, HasSubstr("another veneerd is running"));
  EXPECT_EQ(tree(data), before);
}

TEST_F(Backup, ThatIsDamagedTouchesNothing) {
  const fs::path backup = must(make()).folder;
  add_panel();
  database.reset();
  const auto before = tree(data);
  flip(backup / must(check_backup(backup, {}, quiet)).files.back().file);
  EXPECT_FALSE(restore(backup, data).ok());
  EXPECT_EQ(tree(data), before);
}

TEST_F(Backup, IsNotRestoredForAnotherUser) {
  const fs::path backup = must(make()).folder;
  const fs::path theirs = directory / "theirs";
  fs::create_directories(theirs);
  if (::chown(theirs.c_str(), 65534, 65534) != 0) GTEST_SKIP() << "only root can give a folder away";
  const auto refused = restore(backup, theirs);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("sudo -u"));
  EXPECT_TRUE(fs::is_empty(theirs));
}

}  // namespace
}  // namespace veneer::daemon
