// Backups of a cell's data as folders: what is complete, what is refused, and that nothing is half there.

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/daemon/store/backup_fixture.h"
#include "tests/support/json_schema.h"

namespace veneer::daemon {
namespace {

using db::must;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(Backup, HoldsTheDatabaseAndItsPicturesAndSaysSo) {
  const MadeBackup made = must(make());
  EXPECT_EQ(made.folder, backups / "2026-05-01T07-30-00.000Z");
  const json manifest = manifest_of(made.folder);
  EXPECT_THAT(testing::schema_errors(manifest, "backup.schema.json"), IsEmpty());
  EXPECT_EQ(manifest["counts"]["panels"], 1);
  EXPECT_EQ(manifest["files"].size(), 2U);
  for (const json& file : manifest["files"]) {
    const std::string bytes = bytes_of(made.folder / file["file"].get<std::string>());
    EXPECT_EQ(file["sha256"], hash_of(bytes));
    EXPECT_EQ(file["bytes"], bytes.size());
  }
  EXPECT_EQ(manifest["database"]["sha256"], hash_of(bytes_of(made.folder / kDatabaseName)));
  EXPECT_EQ(tree(made.folder).size(), 4U) << "the database, two pictures, the manifest, and nothing else";
  EXPECT_TRUE(fs::equivalent(data / last_map, made.folder / last_map)) << "a picture takes no room twice";
  EXPECT_EQ(refusal(made.folder), "");
}

TEST_F(Backup, HoldsWhatPlansSay) {
  db::Plans plans(*database);
  db::NewPlan wanted = db::job_of({});
  wanted.target_file.clear();
  const auto plan = must(plans.add(wanted, db::kNow));
  const fs::path backup = must(make()).folder;
  EXPECT_EQ(tree(backup).size(), 5U);
  EXPECT_EQ(refusal(backup), "");
  const fs::path other = directory / "other";
  must(restore(backup, other));
  db::Database restored = must(db::Database::open(other / kDatabaseName));
  EXPECT_EQ(must(db::Plans(restored).plan_json(plan)), db::job_of({}).plan_json);
  // One that is not what its name says is missing.
  const std::string text = db::job_of({}).plan_json, file = "plans/" + hash_of(text) + ".json";
  flip(data / file);
  EXPECT_THAT(must(make()).manifest.missing, ElementsAre(file));
}

TEST_F(Backup, IsCopiedWhereTheFileSystemLinksNothing) {
  const testing::TempDirectory elsewhere(testing::TempDirectory::Place::kDisk);
  const auto made = must(make_backup({data, elsewhere / "backups", 14}, "2026-05-01T07:30:00.000Z", {}, quiet));
  EXPECT_EQ(bytes_of(made.folder / last_map), bytes_of(data / last_map));
  EXPECT_EQ(refusal(made.folder), "");
}

// Then the pictures take room again.
TEST_F(Backup, ThatCannotLinkPicturesNeedsRoomForThem) {
  const testing::TempDirectory elsewhere(testing::TempDirectory::Place::kDisk);
  std::error_code failed;
  fs::create_hard_link(data / last_map, elsewhere / "link", failed);
  if (!failed) GTEST_SKIP() << "there is one file system";
  fs::resize_file(data / last_map, std::uintmax_t{1} << 40);  // and takes no room itself
  const testing::LittleRoom room(20 << 20);
  const auto full = make_backup({data, elsewhere / "backups", 14}, "2026-05-01T07:30:00.000Z", {}, quiet);
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kStorage);
  EXPECT_THAT(full.error().message, HasSubstr("a backup needs 10488"));
  EXPECT_THAT(tree(elsewhere.path()), IsEmpty());
}

// Whoever removes a plan at night must not find a failed backup in the morning.
TEST_F(Backup, APlanThatIsRemovedMeanwhileIsNotMissing) {
  db::Plans plans(*database);
  db::NewPlan wanted = db::job_of({});
  wanted.target_file.clear();
  const auto plan = must(plans.add(wanted, db::kNow));
  bool removed = false;
  const auto made =
      must(make_backup({data, backups, 14}, "2026-05-01T07:30:00.000Z", {}, [&](double, const std::string& text) {
        if (removed || !text.starts_with("picture 1 of")) return;
        removed = true;
        VENEER_EXPECT_OK(plans.remove(plan));
      }));
  EXPECT_TRUE(removed);
  EXPECT_THAT(made.manifest.missing, IsEmpty());
  EXPECT_EQ(refusal(made.folder), "");
  EXPECT_EQ(tree(made.folder).size(), 4U);
  const fs::path other = directory / "other";
  must(restore(made.folder, other));
  db::Database restored = must(db::Database::open(other / kDatabaseName));
  VENEER_EXPECT_OK(db::Plans(restored).check_files());
  EXPECT_FALSE(db::Plans(restored).find(plan).ok());
}

TEST_F(Backup, OldOnesGoOnlyOnceANewOneIsGood) {
  for (int i = 0; i < 3; ++i) must(make(2));
  const auto names = [&] {
    std::vector<std::string> out;
    for (const auto& one : list_backups(backups)) out.push_back(one.name);
    return out;
  };
  EXPECT_THAT(names(), ElementsAre("2026-05-01T07-30-02.000Z", "2026-05-01T07-30-01.000Z"));
  {
    const testing::LittleRoom room(20'000);
    EXPECT_FALSE(make(1).ok());
  }
  EXPECT_EQ(names().size(), 2U);
  EXPECT_THAT(must(make(1)).removed, ElementsAre("2026-05-01T07-30-01.000Z", "2026-05-01T07-30-02.000Z"));
  EXPECT_THAT(names(), ElementsAre("2026-05-01T07-30-04.000Z"));
}

// A clock that was ahead for a while must not cost the backups of the time after it.
TEST_F(Backup, TheOneJustMadeIsNeverRemoved) {
  second = 30;
  for (int i = 0; i < 2; ++i) must(make(2));
  second = 0;
  for (int i = 0; i < 2; ++i) {
    const MadeBackup made = must(make(2));
    EXPECT_TRUE(fs::exists(made.folder));
    EXPECT_EQ(made.removed.size(), static_cast<std::size_t>(i));
  }
  EXPECT_EQ(list_backups(backups).size(), 3U);
}

TEST_F(Backup, ThatWouldFillTheDiskIsNotBegun) {
  const auto full = make_backup({data, backups, 14, std::uint64_t{1} << 60}, "2026-05-01T07:30:00.000Z", {}, quiet);
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kStorage);
  EXPECT_THAT(full.error().message, HasSubstr("MB free on the disk of " + backups.string()));
  EXPECT_THAT(tree(backups), IsEmpty());
}

TEST_F(Backup, TwoCellsDoNotShareAFolderAtATime) {
  std::optional<Result<MadeBackup>> other;
  must(make_backup({data, backups, 14}, "2026-05-01T07:30:00.000Z", {}, [&](double, const std::string&) {
    if (!other) other = make_backup({data, backups, 14}, "2026-05-01T07:30:01.000Z", {}, quiet);
  }));
  ASSERT_TRUE(other.has_value());
  EXPECT_EQ(other->error().code, ErrorCode::kConflict);
  EXPECT_THAT(other->error().message, HasSubstr("a folder of its own"));
  second = 2;
  must(make());
}

// The disk does not give an old picture back any more; the ledger must be saved all the same.
TEST_F(Backup, APictureThatCannotBeReadIsMissing) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can take a file from somebody else";
  for (const fs::path& folder : {directory.path(), data, data / "panels", (data / last_map).parent_path()})
    ASSERT_EQ(::chown(folder.c_str(), 65534, 65534), 0);
  for (const auto& entry : fs::directory_iterator(data)) ASSERT_EQ(::chown(entry.path().c_str(), 65534, 65534), 0);
  fs::permissions(data / last_map, fs::perms::none);
  database.reset();
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(3);
    const auto made = make();
    if (!made) ::_exit(2);
    ::_exit(made->manifest.missing == std::vector<std::string>{last_map} ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Backup, SaysWhichPicturesAreMissingAndKeepsTheOlderOnesThatHaveThem) {
  const fs::path whole = must(make(1)).folder;
  fs::remove(data / last_map);
  const MadeBackup made = must(make(1));
  EXPECT_THAT(made.manifest.missing, ElementsAre(last_map));
  EXPECT_THAT(made.removed, IsEmpty());
  EXPECT_EQ(refusal(made.folder), "") << "it is as it was made";
  EXPECT_EQ(refusal(whole), "");
  // But not every one from then on, for ever.
  const MadeBackup next = must(make(1));
  EXPECT_THAT(next.removed, ElementsAre(made.folder.filename().string()));
  EXPECT_EQ(refusal(whole), "");
}

TEST_F(Backup, APictureThatIsNotWhatItsNameSaysIsMissing) {
  flip(data / last_map);
  EXPECT_THAT(must(make()).manifest.missing, ElementsAre(last_map));
}

TEST_F(Backup, OnAFullDiskIsOneSentenceAndLeavesNothing) {
  const testing::LittleRoom room(20'000);
  const auto full = make();
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kStorage);
  EXPECT_THAT(full.error().message, HasSubstr("make room on the disk"));
  EXPECT_THAT(tree(backups), IsEmpty());
  EXPECT_TRUE(fs::is_empty(backups));
}

TEST_F(Backup, WhereNothingCanBeWrittenIsOneSentence) {
  write(directory / "file", "in the way");
  const auto refused = make_backup({data, directory / "file" / "backups", 14}, "2026-05-01T07:30:00.000Z", {}, quiet);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kStorage);
  EXPECT_THAT(refused.error().message, HasSubstr("backup_dir"));
}

TEST_F(Backup, ThatIsStoppedLeavesNothing) {
  std::stop_source stop;
  const auto stopped = make_backup({data, backups, 14}, "2026-05-01T07:30:00.000Z", stop.get_token(),
                                   [&](double fraction, const std::string&) {
                                     if (fraction > 0.5) stop.request_stop();
                                   });
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(fs::is_empty(backups));
}

TEST_F(Backup, WhatAKilledDaemonLeftOfOneGoesWithTheNext) {
  write(backups / ".making-2026-05-01T07-29-00.000Z" / kDatabaseName, "half");
  EXPECT_THAT(list_backups(backups), IsEmpty());
  must(make());
  EXPECT_EQ(list_backups(backups).size(), 1U);
  EXPECT_FALSE(fs::exists(backups / ".making-2026-05-01T07-29-00.000Z"));
}

TEST_F(Backup, WithADamagedPictureIsRefusedByItsName) {
  const fs::path backup = must(make()).folder;
  flip(backup / last_map);
  EXPECT_THAT(refusal(backup), HasSubstr(last_map + " is not what was written"));
  fs::remove(backup / last_map);
  EXPECT_THAT(refusal(backup), HasSubstr("lacks " + (backup / last_map).string()));
}

TEST_F(Backup, WithADamagedDatabaseIsRefused) {
  const fs::path backup = must(make()).folder;
  flip(backup / kDatabaseName);
  EXPECT_THAT(refusal(backup), HasSubstr("veneerd.db is not what was written"));
}

// Somebody who changes the manifest with it does not get past the rows' own checksums.
TEST_F(Backup, WithAnotherDatabaseAndItsHashIsRefused) {
  const fs::path backup = must(make()).folder;
  std::string bytes = bytes_of(backup / kDatabaseName);
  const auto at = bytes.find("walnut and maple");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'W';
  write(backup / kDatabaseName, bytes);
  json manifest = manifest_of(backup);
  manifest["database"]["sha256"] = hash_of(bytes);
  write(backup / kManifestName, manifest.dump());
  EXPECT_THAT(refusal(backup), HasSubstr("1 of the rows of panels is not what was written"));
  EXPECT_THAT(refusal(backup), HasSubstr("take another backup"));
}

TEST_F(Backup, WhoseManifestDoesNotHoldIsRefused) {
  const fs::path backup = must(make()).folder;
  const json good = manifest_of(backup);
  json less = good;
  less["files"].erase(0);
  write(backup / kManifestName, less.dump());
  EXPECT_THAT(refusal(backup), HasSubstr("which its database names"));
  for (const char* path : {"../map.png", "/etc/passwd", "veneerd.db-wal", "panels/../../map.png", "panels/"}) {
    json outside = good;
    outside["files"][0]["file"] = path;
    write(backup / kManifestName, outside.dump());
    EXPECT_THAT(refusal(backup), HasSubstr("manifest.json is damaged")) << path;
  }
  write(backup / kManifestName, good.dump().substr(0, 100));
  EXPECT_THAT(refusal(backup), HasSubstr("manifest.json is damaged"));
  EXPECT_THAT(list_backups(backups).at(0).fault, HasSubstr("manifest.json is damaged"));
  fs::remove(backup / kManifestName);
  EXPECT_THAT(refusal(backup), HasSubstr("is no backup"));
}

}  // namespace
}  // namespace veneer::daemon
