// What a database says of a disk that is full or read-only, of a file that may only be read, and of another program
// that holds it: one sentence that names the file and what to do.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/audit.h"
#include "tests/db/cell_database.h"
#include "tests/support/own_disk.h"

namespace veneer::db {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::OwnDisk;

std::string opening(const fs::path& file) {
  auto opened = Database::open(file);
  return opened ? "opened" : opened.error().message;
}

TEST(DatabaseDisk, FullAtTheFirstStart) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  const auto said = OwnDisk::run(directory.path(), 1 << 20, [&](const OwnDisk& disk) {
    disk.fill();
    return opening(file);
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_THAT(*said, HasSubstr("disk is full"));
  EXPECT_THAT(*said, HasSubstr(file.string()));
}

TEST(DatabaseDisk, FullWhileItIsAtWorkAndThenNot) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  const auto said = OwnDisk::run(directory.path(), 2 << 20, [&](const OwnDisk& disk) {
    Database database = must(Database::open(file));
    disk.fill();
    std::string refused;
    for (int i = 0; i < 1000 && refused.empty(); ++i)
      if (const Status written = Audit(database).append({0, kNow, "test", "fill", std::string(20'000, 'x')}); !written)
        refused = written.error().message;
    fs::remove(directory / "filler");
    const Status again = Audit(database).append({0, kNow, "test", "fill", "more"});
    return refused + (again && database.check_integrity() ? " / written" : " / refused");
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_THAT(*said, HasSubstr("disk is full"));
  EXPECT_THAT(*said, HasSubstr(file.string()));
  EXPECT_THAT(*said, HasSubstr(" / written"));
}

TEST(DatabaseDisk, ReadOnly) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  const auto said = OwnDisk::run(directory.path(), 2 << 20, [&](const OwnDisk& disk) {
    { const Database made = must(Database::open(file)); }
    disk.make_read_only();
    return opening(file);
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_THAT(*said, HasSubstr("because its disk is mounted read-only: mount it for writing"));
}

// Somebody copied it back as another user: SQLite would go on as a reader, and nothing would be booked.
TEST(DatabaseDisk, AFileThatMayOnlyBeReadIsRefusedAtTheStart) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  { const Database made = must(Database::open(file)); }
  fs::permissions(directory.path(), fs::perms::all);
  for (const char* part : {"", ".lock"}) fs::permissions(file.string() + part, static_cast<fs::perms>(0644));
  fs::permissions(file.string() + ".lock", static_cast<fs::perms>(0666));
  int way[2];
  ASSERT_EQ(::pipe(way), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (::geteuid() != 0) fs::permissions(file, static_cast<fs::perms>(0444));
    if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(1);
    const std::string said = opening(file);
    ::_exit(::write(way[1], said.data(), said.size()) > 0 ? 0 : 1);
  }
  ::close(way[1]);
  char text[1000] = {};
  const ssize_t got = ::read(way[0], text, sizeof text - 1);
  ::close(way[0]);
  ::waitpid(child, nullptr, 0);
  ASSERT_GT(got, 0);
  EXPECT_EQ(std::string(text),
            "the database " + file.string() + " cannot be written: check its permissions, and whose it is");
}

TEST(DatabaseDisk, AnotherProgramThatHoldsItIsToldOf) {
  CellDatabase cell;
  SQLite::Database other(cell.file().string(), SQLite::OPEN_READWRITE);
  other.exec("BEGIN IMMEDIATE");
  const Status refused = Audit(cell.database()).append({0, kNow, "test", "write", ""});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(refused.error().message,
            "the database " + cell.file().string() + " is busy, because another program holds it: end that one");
  other.exec("ROLLBACK");
  VENEER_EXPECT_OK(Audit(cell.database()).append({0, kNow, "test", "write", ""}));
}

}  // namespace
}  // namespace veneer::db
