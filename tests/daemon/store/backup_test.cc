// Backups of a cell's data as folders, and a data folder made of one again: what is complete, what is refused, and that
// nothing is half there.
#include "daemon/store/backup.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "base/archive.h"
#include "base/files.h"
#include "base/hash.h"
#include "daemon/store/restore.h"
#include "db/accounts.h"
#include "db/audit.h"
#include "tests/db/cell_database.h"
#include "tests/support/json_schema.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using db::must;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string bytes_of(const fs::path& file) { return read_whole(file).value_or(""); }
void write(const fs::path& file, const std::string& bytes) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}
std::string hash_of(const std::string& bytes) { return sha256_hex(std::as_bytes(std::span(bytes))); }

// Everything below a folder, by name.
std::map<std::string, std::string> tree(const fs::path& folder) {
  std::map<std::string, std::string> out;
  if (fs::exists(folder))
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) out[fs::relative(entry.path(), folder)] = bytes_of(entry.path());
  return out;
}

// From now on no file may grow beyond this.
class LittleRoom {
 public:
  explicit LittleRoom(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit little{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &little);
  }
  LittleRoom(const LittleRoom&) = delete;
  LittleRoom& operator=(const LittleRoom&) = delete;
  ~LittleRoom() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

class Backup : public ::testing::Test {
 protected:
  Backup() {
    database.emplace(must(db::Database::open(data / kDatabaseName)));
    add_panel();
  }
  // With a map and a mask as the panel library names them.
  void add_panel() {
    db::Panels panels(*database);
    db::PanelRecord panel = db::sheet(must(panels.next_panel_id()));
    const auto store = [&](const std::string& what) {
      const std::string bytes = what + " of " + panel.id.value;
      const std::string file = fmt::format("panels/{}/{}-{}.png", panel.id.value, what, hash_of(bytes).substr(0, 16));
      write(data / file, bytes);
      return file;
    };
    panel.map_file = last_map = store("map");
    panel.mask_file = store("mask");
    VENEER_EXPECT_OK(panels.add(panel, {}, {}));
  }
  Result<MadeBackup> make(int keep = 14) {
    return make_backup({data, backups, keep}, fmt::format("2026-05-01T07:30:{:02}.000Z", second++), {}, quiet);
  }
  // The same change as a disk makes it.
  static void flip(const fs::path& file) {
    std::string bytes = bytes_of(file);
    ASSERT_FALSE(bytes.empty());
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    fs::remove(file);  // the picture in stock may be the same file
    write(file, bytes);
  }
  static std::string refusal(const fs::path& backup) {
    const auto checked = check_backup(backup, {}, quiet);
    return checked ? "" : checked.error().message;
  }
  static json manifest_of(const fs::path& backup) { return json::parse(bytes_of(backup / kManifestName)); }
  static std::size_t panels_in(const fs::path& file) {
    db::Database opened = must(db::Database::open(file));
    VENEER_EXPECT_OK(opened.check_integrity());
    return must(db::Panels(opened).list()).size();
  }
  Result<Restored> restore(const fs::path& backup, const fs::path& to, const std::function<void()>& step = {}) {
    return restore_backup({backup, to, "uid 1000", fmt::format("2026-05-02T07:30:{:02}.000Z", second++)}, quiet, step);
  }
  // Does its first panel count as unseen, and does its audit log say who put it there?
  static bool is_marked(const fs::path& file) {
    db::Database opened = must(db::Database::open(file));
    const bool unseen = !db::Panels(opened).check_seen({"P-0001"}).ok();
    const auto noted = must(db::Audit(opened).latest(1));
    EXPECT_EQ(!noted.empty() && noted.front().what == "store.restore", unseen);
    return unseen;
  }

  static void quiet(double, const std::string&) {}

  testing::TempDirectory directory;
  const fs::path data = directory / "data", backups = directory / "backups";
  std::optional<db::Database> database;
  std::string last_map;
  int second = 0;
};

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
  const LittleRoom room(20 << 20);
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
    const LittleRoom room(20'000);
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
  const LittleRoom room(20'000);
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

// The program dies before each change of the disk in turn: the next start has the old database or the new one, whole,
// with every picture that it names; and once more restored, the new one.
TEST_F(Backup, CutShortAnywhereLeavesTheOldOrTheNewDatabase) {
  const std::string first_map = last_map;
  const fs::path backup = must(make()).folder;
  add_panel();
  database.reset();
  fs::remove(data / first_map);
  for (const char* name : {kAlarmsName, kTasksName}) write(data / name, "[{}]");
  bool finished = false;
  int before_the_end = 0, decided = 0;
  for (int cut = 1; !finished; ++cut) {
    const fs::path there = directory / fmt::format("cut-{}", cut);
    fs::copy(data, there, fs::copy_options::recursive);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      int steps = 0;
      const bool done = restore(backup, there, [&] {
                          if (++steps == cut) ::_exit(2);
                        }).ok();
      ::_exit(done ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ++second;  // the child's time has passed here too
    ASSERT_TRUE(WIFEXITED(status));
    ASSERT_NE(WEXITSTATUS(status), 1) << "step " << cut;
    finished = WEXITSTATUS(status) == 0;
    const std::size_t panels = panels_in(there / kDatabaseName);
    EXPECT_TRUE(panels == 2U || panels == 1U) << "step " << cut;
    EXPECT_FALSE(finished && panels == 2U);
    EXPECT_EQ(is_marked(there / kDatabaseName), panels == 1U) << "step " << cut;
    EXPECT_TRUE(fs::exists(there / last_map));
    if (panels == 1U) {
      EXPECT_FALSE(fs::exists(there / kAlarmsName)) << "step " << cut;
      EXPECT_FALSE(fs::exists(there / kTasksName)) << "step " << cut;
    }
    before_the_end += finished ? 0 : 1;
    decided += !finished && panels == 1U ? 1 : 0;
    must(restore(backup, there));
    EXPECT_EQ(panels_in(there / kDatabaseName), 1U) << "step " << cut;
    EXPECT_EQ(bytes_of(there / first_map), bytes_of(backup / first_map));
    EXPECT_FALSE(fs::exists(there / "veneerd.db.restoring")) << "step " << cut;
  }
  EXPECT_EQ(decided, 1) << "the new database counts, and is not in its place yet";
  EXPECT_GE(before_the_end, 7) << "the old database, a picture and the new database, each in its steps";
}

}  // namespace
}  // namespace veneer::daemon
