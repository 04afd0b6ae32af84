// Copies of a database that is in use, whether they are as they were written, and their way back into its place.
#include "db/backup.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "db/audit.h"
#include "db/migrations.h"
#include "tests/db/filled_cell.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Backups : public ::testing::Test {
 protected:
  Backups() {
    fill(cell);
    // Several steps of a copy.
    Audit audit(cell.database());
    for (int i = 0; i < 40; ++i) VENEER_EXPECT_OK(audit.append({0, kNow, "test", "fill", std::string(100'000, 'x')}));
  }
  Status make(const std::function<void(double)>& progress = {}, const std::stop_token& stop = {}) {
    Database reading = must(Database::open_for_reading(cell.file()));
    return copy_database(reading, copy, progress, stop);
  }
  static std::size_t audit_rows(const fs::path& file) {
    Database reading = must(Database::open_for_reading(file));
    return must(Audit(reading).latest(1000)).size();
  }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::directory_iterator(directory.path())) out.push_back(entry.path().filename());
    std::sort(out.begin(), out.end());
    return out;
  }

  CellDatabase cell;
  testing::TempDirectory directory;
  const fs::path copy = directory / "copy.db";
};

TEST_F(Backups, HoldWhatWasCommittedWhenTheyBeganWhileTheCellGoesOn) {
  const std::size_t before = audit_rows(cell.file());
  int steps = 0;
  const Status made = make([&](double) {
    ++steps;
    VENEER_EXPECT_OK(Audit(cell.database()).append({0, kLater, "test", "meanwhile", ""}));
  });
  VENEER_ASSERT_OK(made);
  EXPECT_GT(steps, 3);
  EXPECT_EQ(audit_rows(cell.file()), before + static_cast<std::size_t>(steps));
  EXPECT_EQ(audit_rows(copy), before);
  EXPECT_EQ(must(check_copy(copy, {})), migrations().back().version);
}

TEST_F(Backups, ArePlainFilesThatNeedNothingBesideThem) {
  VENEER_ASSERT_OK(make());
  EXPECT_THAT(names(), ElementsAre("copy.db"));
  std::ifstream file(copy, std::ios::binary);
  std::string header(20, '\0');
  file.read(header.data(), 20);
  EXPECT_EQ(header[18], 1) << "no log is needed to write it";
  EXPECT_EQ(header[19], 1) << "nor to read it";
  EXPECT_EQ(must(check_copy(copy, {})), migrations().back().version);
  EXPECT_THAT(names(), ElementsAre("copy.db")) << "to look at it leaves nothing";
}

TEST_F(Backups, OfWhichOneIsStoppedLeaveNothing) {
  std::stop_source stop;
  const Status stopped = make([&](double) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_THAT(names(), ElementsAre());
}

TEST_F(Backups, ThatTheDiskDoesNotTakeLeaveNothing) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit little{1 << 20, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &little);
  const Status full = make();
  setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kStorage);
  EXPECT_THAT(full.error().message, HasSubstr("make room on the disk"));
  EXPECT_THAT(names(), ElementsAre());
  VENEER_EXPECT_OK(make());
}

TEST_F(Backups, KnowWhatTheyHold) {
  VENEER_ASSERT_OK(make());
  Database reading = must(Database::open_for_reading(copy));
  const Contents contents = must(read_contents(reading));
  EXPECT_EQ(contents.schema, migrations().back().version);
  EXPECT_EQ(contents.panels, 7);
  EXPECT_EQ(contents.jobs, 3);
  EXPECT_EQ(contents.pieces, 10);
  const std::string said = job_of({}).plan_json, plan = "plans/" + sha256_hex(std::as_bytes(std::span(said))) + ".json";
  EXPECT_THAT(
      contents.files,
      // What a painted mask was made of, pictures of remnants, and open proposals, too.
      ElementsAre("maps/2-mask.png", "maps/2.png", "maps/3-mask.png", "maps/3-painted.png", "maps/3.png",
                  "maps/P-0001-mask.png", "maps/P-0001.png", "maps/P-0002-mask.png", "maps/P-0002.png",
                  "maps/P-0003-mask.png", "maps/P-0003.png", "maps/P-0004-mask.png", "maps/P-0004.png",
                  "maps/P-0005-mask.png", "maps/P-0005.png", "maps/P-0006-mask.png", "maps/P-0006.png",
                  "maps/P-0007-mask.png", "maps/P-0007.png", "panels/P-0001/left.png", plan, "proposals/map.png",
                  "proposals/mask.png", "proposals/read.json", "scans/1.png", "scans/9.png", "target.png"));
}

TEST_F(Backups, HoldTheDrawingsThatLayoutsWereMadeOf) {
  NewPlan drawn = job_of({});
  drawn.options_json = R"({"segmentation_bytes":6,"segmentation_file":"drawings/d"})";
  must(Plans(cell.database()).add(drawn, kNow));
  Database reading = must(Database::open_for_reading(cell.file()));
  EXPECT_THAT(must(read_contents(reading)).files, ::testing::Contains("drawings/d"));
}

TEST_F(Backups, InWhichABitHasFlippedAreRefused) {
  VENEER_ASSERT_OK(make());
  damage_unseen(copy, "split in two", "Split in two");
  fs::remove(copy.string() + ".clean");
  const auto checked = check_copy(copy, {});
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(checked.error().code, ErrorCode::kStorage);
  EXPECT_EQ(checked.error().message, "1 of the rows of retirements is not what was written");
}

TEST_F(Backups, OfAnotherProgramAreRefused) {
  SQLite::Database(copy.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec("CREATE TABLE notes (line TEXT)");
  const auto checked = check_copy(copy, {});
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(checked.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(checked.error().message, HasSubstr("another program"));
}

TEST_F(Backups, OfANewerProgramAreRefusedAndOfAnOlderTaken) {
  VENEER_ASSERT_OK(make());
  tamper(copy, "PRAGMA user_version = 9999");
  const auto newer = check_copy(copy, {});
  ASSERT_FALSE(newer.ok());
  EXPECT_EQ(newer.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(newer.error().message, HasSubstr("install the newer veneerd"));

  fs::remove(copy);
  {
    SQLite::Database old(copy.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    register_functions(old);
    old.exec("PRAGMA application_id = 1447970130");
    VENEER_ASSERT_OK(migrate(old, migrations().first(7)));
  }
  EXPECT_EQ(must(check_copy(copy, {})), 7);
  // It is brought up to date before it takes a place, and is a plain file again.
  std::ofstream(copy.string() + "-wal") << "the log of one that was cut short";
  VENEER_ASSERT_OK(change_copy(
      copy, [](Database& database) { return Panels(database).note_restoration(kNow, "uid 1000", kLater); }));
  EXPECT_EQ(must(check_copy(copy, {})), migrations().back().version);
  EXPECT_THAT(names(), ElementsAre("copy.db"));
  EXPECT_EQ(change_copy(copy,
                        [](Database&) {
                          return Status(Error{ErrorCode::kRefused, "no"});
                        })
                .error()
                .code,
            ErrorCode::kRefused);
  EXPECT_THAT(names(), ElementsAre("copy.db"));
}

// The power was cut after the restored database was there under its second name: it counts, and the log that was left
// beside the old one is not taken for its own.
TEST_F(Backups, OnceDecidedAreInPlaceAtTheNextStart) {
  VENEER_ASSERT_OK(make());
  const std::size_t then = audit_rows(copy);
  VENEER_ASSERT_OK(Audit(cell.database()).append({0, kLater, "test", "later", ""}));
  const auto log = cell.file().string() + "-wal", kept = (directory / "log").string();
  fs::copy_file(log, kept);
  { const Database closed = std::move(cell.database()); }
  fs::copy_file(kept, log, fs::copy_options::overwrite_existing);
  fs::rename(copy, cell.file().string() + ".restored");
  cell.reopen();
  EXPECT_EQ(must(Audit(cell.database()).latest(1000)).size(), then);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

// The disk does not say whether it is there: that is no answer.
TEST_F(Backups, OnceDecidedAreNotPassedOverWhenTheDiskDoesNotAnswer) {
  { const Database closed = std::move(cell.database()); }
  const fs::path restored = cell.file().string() + ".restored";
  fs::create_symlink(restored, restored);  // a loop
  const auto opened = Database::open(cell.file());
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("cannot look whether there is a file " + restored.string()));
  fs::remove(restored);
  cell.reopen();
}

// The file could not be looked at once; that it was made here is not forgotten for that.
TEST_F(Backups, ADatabaseThatCannotBeLookedAtIsNotGone) {
  { const Database closed = std::move(cell.database()); }
  const fs::path kept = directory / "kept";
  fs::rename(cell.file(), kept);
  fs::create_symlink(cell.file(), cell.file());
  EXPECT_FALSE(Database::open(cell.file()).ok());
  fs::remove(cell.file());
  std::ofstream(cell.file()).flush();
  const auto empty = Database::open(cell.file());
  ASSERT_FALSE(empty.ok());
  EXPECT_THAT(empty.error().message, HasSubstr("it is empty"));
  fs::rename(kept, cell.file());
  cell.reopen();
}

}  // namespace
}  // namespace veneer::db
