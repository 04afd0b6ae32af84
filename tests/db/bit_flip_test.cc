// A disk that forgets bits, bytes, pages and whole writes, and a log that is not the file's: whatever it changes of
// what counts, the database is refused at its next start; where it is taken, everything in it is as it was written.
// `./dev soak ledger` runs more, with fresh seeds (VENEER_SEED, VENEER_FLIPS, VENEER_CORRUPTIONS).
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "tests/db/a_day.h"
#include "tests/db/everything.h"
#include "tests/db/filled_cell.h"
#include "tests/db/stray_sql.h"
#include "tests/support/campaign_size.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;
using testing::number_from;

std::string read_file(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}
void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

class BitFlipTest : public ::testing::Test {
 protected:
  void SetUp() override {
    {
      CellDatabase cell;
      fill(cell);
      file_ = cell.file();
      close(cell);
      earlier_ = read_file(file_);
      // Another day, of which the log is kept, then some more.
      cell.reopen();
      commits_ = {rows_in(cell.database().connection())};
      const auto committed = [&](const Status& done) {
        VENEER_ASSERT_OK(done);
        commits_.push_back(rows_in(cell.database().connection()));
      };
      committed(cell.jobs().settle(PieceId{5}, AllocationState::kCut, kLater, "user anna"));
      committed(cell.jobs().cancel(JobId{3}, kLater));
      committed(cell.ledger().write_off(PanelId{"P-0001"}, Region<PanelFrame>(square(360, 200, 20)), "a knot", kLater));
      log_ = read_file(file_.string() + "-wal");
      close(cell);
      cell.reopen();
      VENEER_ASSERT_OK(Audit(cell.database()).append({0, kLater, "local:1000", "job.cancel", "by hand"}));
      VENEER_ASSERT_OK(cell.panels().retire(PanelId{"P-0003"}, "lost", kLater));
      SQLite::Database& connection = cell.database().connection();
      wanted_ = everything_in(connection);
      for (const auto& table : tables(connection))
        for (const auto& column : texts(connection, "SELECT name FROM pragma_table_info('" + table + "')"))
          for (const auto& value : texts(connection, fmt::format("SELECT {} FROM {}", column, table)))
            if (value.size() >= 3) values_.push_back(value);
      close(cell);
      bytes_ = read_file(file_);
      mark_ = read_file(file_.string() + ".clean");
      lock_ = read_file(file_.string() + ".lock");
      cell.reopen();
    }
    file_ = directory_ / "veneerd.db";
  }
  static void close(CellDatabase& cell) { const Database closed = std::move(cell.database()); }

  enum class Outcome { kRefused, kUnchanged, kTaken };
  // What a daemon finds at its start.
  void lay_out(const std::string& bytes, const std::string& log, bool marked) {
    for (const char* beside : {"-wal", "-shm", ".clean"}) std::filesystem::remove(file_.string() + beside);
    write_file(file_, bytes);
    write_file(file_.string() + ".lock", lock_);
    if (!log.empty()) write_file(file_.string() + "-wal", log);
    if (marked) write_file(file_.string() + ".clean", mark_);
  }
  // Opened and read as a daemon would.
  Outcome open_changed(const std::string& changed, bool marked, const std::string& log = "") {
    lay_out(changed, log, marked);
    auto opened = Database::open(file_);
    if (!opened.ok()) return Outcome::kRefused;
    try {
      return everything_in(opened->connection()) == wanted_ ? Outcome::kUnchanged : Outcome::kTaken;
    } catch (const SQLite::Exception&) {
      return Outcome::kTaken;  // it was said to be sound
    }
  }
  Outcome open_with_flip(std::size_t at, int bit, bool marked) {
    std::string changed = bytes_;
    changed[at] = static_cast<char>(changed[at] ^ (1 << bit));
    return open_changed(changed, marked);
  }

  static std::string ledger_in(SQLite::Database& connection) {
    std::string out;
    for (const char* rows :
         {"SELECT id || panel || coalesce(piece, '') || state || area_um || changed_at FROM allocations ORDER BY id",
          "SELECT id || allocation || state || at || coalesce(run, '') FROM allocation_history ORDER BY id",
          "SELECT piece || job || mark || state FROM piece_states ORDER BY piece",
          "SELECT id || job || panel || started_at || coalesce(ended_at, '') || result FROM runs ORDER BY id",
          "SELECT id || what FROM audit ORDER BY id"})
      for (const auto& row : texts(connection, rows)) out += row + "\n";
    return out;
  }

  testing::TempDirectory directory_;
  std::filesystem::path file_;
  std::string bytes_, mark_, lock_, wanted_;
  std::string earlier_, log_;         // the file as a session began, and the log of it
  std::vector<std::string> commits_;  // the rows when it began, and after each of its transactions
  std::vector<std::string> values_;   // as they are stored
};

TEST_F(BitFlipTest, TheFileAsItWasLeftIsTaken) {
  for (const bool marked : {true, false}) {
    write_file(file_, bytes_);
    if (marked) write_file(file_.string() + ".clean", mark_);
    Database database = must(Database::open(file_));
    EXPECT_EQ(everything_in(database.connection()), wanted_);
  }
}

// Aimed at what is written in rows: outlines, states, marks, names, times.
TEST_F(BitFlipTest, NoChangedRowIsTaken) {
  std::mt19937 random(number_from("VENEER_SEED", 20260501));
  const auto flips = static_cast<std::uint32_t>(number_from("VENEER_FLIPS", 150 / testing::kFewer));
  std::uint32_t refused = 0, unchanged = 0;
  for (std::uint32_t i = 0; i < flips; ++i) {
    const std::string& value = values_[random() % values_.size()];
    std::vector<std::size_t> places;
    for (auto at = bytes_.find(value); at != std::string::npos; at = bytes_.find(value, at + 1)) places.push_back(at);
    if (places.empty()) continue;  // a number
    const std::size_t place = places[random() % places.size()], at = place + random() % value.size();
    const int bit = static_cast<int>(random() % 8);
    const Outcome outcome = open_with_flip(at, bit, i % 2 == 0);
    EXPECT_NE(outcome, Outcome::kTaken) << "byte " << at << ", bit " << bit << ", of " << value;
    (outcome == Outcome::kRefused ? refused : unchanged) += 1;
  }
  std::printf("%u flips in rows: %u refused, %u changed nothing\n", refused + unchanged, refused, unchanged);
  // Bytes of a row that has moved within its page are nobody's; there are few of them.
  EXPECT_GT(refused, 9 * unchanged);
}

TEST_F(BitFlipTest, WhereverABitFlipsNothingChangedIsTaken) {
  std::mt19937 random(number_from("VENEER_SEED", 20260502));
  const auto flips = static_cast<std::uint32_t>(number_from("VENEER_FLIPS", 150 / testing::kFewer));
  std::uint32_t refused = 0;
  for (std::uint32_t i = 0; i < flips; ++i) {
    // A third of them in the header and the first page, which says how all others are read.
    const std::size_t at = random() % (i % 3 == 0 ? 512 : bytes_.size());
    const int bit = static_cast<int>(random() % 8);
    const Outcome outcome = open_with_flip(at, bit, i % 2 == 0);
    EXPECT_NE(outcome, Outcome::kTaken) << "byte " << at << ", bit " << bit;
    refused += outcome == Outcome::kRefused ? 1 : 0;
  }
  std::printf("%u flips anywhere: %u refused, %u changed nothing\n", flips, refused, flips - refused);
}

constexpr std::size_t kPage = 4096;

TEST_F(BitFlipTest, NoDamagedPageIsTaken) {
  enum Kind { kBytes, kZeroed, kSwapped, kCopied, kTruncated, kLonger, kKinds };
  constexpr const char* kNames[] = {"bytes changed",     "page zeroed",    "pages swapped",
                                    "page over another", "file truncated", "file longer"};
  std::mt19937 random(number_from("VENEER_SEED", 20260503));
  const auto below = [&](std::size_t limit) { return random() % limit; };
  const std::size_t pages = bytes_.size() / kPage;
  const auto rounds = number_from("VENEER_CORRUPTIONS", 100 / testing::kFewer);
  std::array<int, kKinds> refused{}, harmless{};
  for (std::uint64_t i = 0; i < rounds; ++i) {
    const auto kind = static_cast<Kind>(i % kKinds);
    const bool marked = below(3) == 0;
    std::string changed = bytes_;
    const std::size_t one = below(pages), other = below(pages);
    switch (kind) {
      case kBytes:
        for (std::size_t at = below(bytes_.size()), end = std::min(bytes_.size(), at + 1 + below(64)); at < end; ++at)
          changed[at] = static_cast<char>(random());
        break;
      case kZeroed:
        changed.replace(one * kPage, kPage, kPage, '\0');
        break;
      case kSwapped:
        changed.replace(other * kPage, kPage, bytes_, one * kPage, kPage);
        [[fallthrough]];
      case kCopied:
        changed.replace(one * kPage, kPage, bytes_, other * kPage, kPage);
        break;
      case kTruncated:
        changed.resize(below(2) == 0 ? one * kPage : below(bytes_.size()));
        break;
      case kLonger:
        for (std::size_t n = 1 + below(2 * kPage); n > 0; --n) changed += static_cast<char>(random());
        break;
      case kKinds:
        break;
    }
    const Outcome outcome = open_changed(changed, marked);
    EXPECT_NE(outcome, Outcome::kTaken) << kNames[kind] << ", round " << i << ", pages " << one << " and " << other;
    (outcome == Outcome::kRefused ? refused : harmless)[kind] += 1;
  }
  for (int kind = 0; kind < kKinds; ++kind)
    std::printf("%-18s %4d refused, %3d changed nothing\n", kNames[kind], refused[kind], harmless[kind]);
}

// A page without rows, as many a table had once, over the only page of a table: each row that is left is as it was.
TEST_F(BitFlipTest, AnEmptyPageOverASmallTableIsNotTaken) {
  std::map<std::string, std::size_t> roots;
  write_file(file_, bytes_);
  {
    SQLite::Database reading(file_.string(), SQLite::OPEN_READONLY);
    SQLite::Statement all(reading, "SELECT name, rootpage FROM sqlite_schema WHERE type = 'table' AND rootpage > 0");
    while (all.executeStep()) roots[all.getColumn(0).getString()] = static_cast<std::size_t>(all.getColumn(1).getInt());
  }
  int emptied = 0;
  for (const auto& [table, root] : roots) {
    const std::size_t at = (root - 1) * kPage;
    const char kind = bytes_[at];
    if (kind != 0x0D && kind != 0x0A) continue;                // it has several pages
    if (bytes_[at + 3] == 0 && bytes_[at + 4] == 0) continue;  // it has no row
    std::string changed = bytes_;
    changed.replace(at, kPage, kPage, '\0');
    changed[at] = kind;
    changed[at + 5] = static_cast<char>(kPage >> 8);  // where the cells begin: at its end
    for (const bool marked : {true, false})
      EXPECT_EQ(open_changed(changed, marked), Outcome::kRefused) << table << (marked ? ", marked" : "");
    ++emptied;
  }
  EXPECT_GT(emptied, 15);
}

// A disk that acknowledged a write and kept the page as it was before: whole, with rows that are all sound. What tells
// is the mark of an orderly end; without one, that two places speak of the same wood.
TEST_F(BitFlipTest, NoLostPageOfATransactionChangesTheLedger) {
  CellDatabase cell;
  const auto image = [&] {
    close(cell);
    std::string bytes = read_file(cell.file());
    cell.reopen();
    return bytes;
  };
  std::string before = image();
  int refused = 0, taken = 0;
  unsigned lost = 0;
  for (const Step& step : a_day()) {
    VENEER_ASSERT_OK(step(cell.database()));
    const std::string ledger = ledger_in(cell.database().connection()), after = image();
    for (std::size_t at = 0; at < std::min(before.size(), after.size()); at += kPage) {
      if (after.compare(at, kPage, before, at, kPage) == 0 || lost++ % testing::kFewer != 0) continue;
      std::string changed = after;
      changed.replace(at, kPage, before, at, kPage);
      lay_out(changed, "", false);
      auto opened = Database::open(file_);
      if (!opened.ok() && ++refused > 0) continue;
      EXPECT_EQ(ledger_in(opened->connection()), ledger) << step.name << ", page " << at / kPage;
      ++taken;
    }
    before = after;
  }
  std::printf("lost pages: %d refused, %d of other tables\n", refused, taken);
  EXPECT_GT(refused, 5 * taken);
}

// Left by a program that was killed before a backup was put in its place by hand, or by a disk that forgot its removal.
TEST_F(BitFlipTest, ALogThatIsNotTheFilesIsNotPlayedIntoIt) {
  ASSERT_GT(log_.size(), 3 * kPage);
  for (const auto& log : {log_, log_.substr(0, log_.size() / 2), std::string(5000, 'x')}) {
    lay_out(bytes_, log, true);
    const auto opened = Database::open(file_);
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
    EXPECT_THAT(opened.error().message, HasSubstr("lies a log that is not its own"));
    // Nothing was done to either, and without the log all is well.
    EXPECT_EQ(read_file(file_), bytes_);
    EXPECT_EQ(read_file(file_.string() + "-wal"), log);
    std::filesystem::remove(file_.string() + "-wal");
    EXPECT_EQ(everything_in(must(Database::open(file_)).connection()), wanted_);
  }
  // Without a mark nothing says which of the two is the newer one: what both make together is sound, or it is refused.
  lay_out(bytes_, log_, false);
  if (auto opened = Database::open(file_); opened.ok()) {
    const auto found = rows_in(opened->connection());
    EXPECT_TRUE(found == commits_.back() || everything_in(opened->connection()) == wanted_);
  }
}

// A kill, and then a log that cannot be read to its end: what a power cut may leave as well, so that no program can
// tell the two apart. What counts then is some commit, whole, and never a mixture.
TEST_F(BitFlipTest, ADamagedLogLeavesSomeCommitWhole) {
  std::mt19937 random(number_from("VENEER_SEED", 20260504));
  const auto rounds = number_from("VENEER_CORRUPTIONS", 100 / testing::kFewer);
  std::vector<int> ended_at(commits_.size());
  int refused = 0;
  for (std::uint64_t i = 0; i < rounds; ++i) {
    std::string log = log_;
    for (std::size_t at = random() % log.size(), end = std::min(log.size(), at + 1 + random() % 64); at < end; ++at)
      log[at] = static_cast<char>(random());
    lay_out(earlier_, log, false);
    auto opened = Database::open(file_);
    if (!opened.ok() && ++refused > 0) continue;
    const auto known = std::find(commits_.begin(), commits_.end(), rows_in(opened->connection()));
    ASSERT_NE(known, commits_.end()) << "round " << i;
    ++ended_at[static_cast<std::size_t>(known - commits_.begin())];
  }
  std::printf("damaged logs: %d refused, as after", refused);
  for (std::size_t k = 0; k < ended_at.size(); ++k) std::printf(" %zu commits %d,", k, ended_at[k]);
  std::printf(" of %zu\n", commits_.size() - 1);
}

TEST(CleanEnd, IsMarkedAndAKillIsNot) {
  CellDatabase cell;
  const auto mark = cell.file().string() + ".clean";
  EXPECT_FALSE(std::filesystem::exists(mark)) << "while it is open, a kill leaves no mark";
  { const Database closed = std::move(cell.database()); }
  EXPECT_TRUE(std::filesystem::exists(mark));
  EXPECT_FALSE(std::filesystem::exists(cell.file().string() + "-wal"));
  cell.reopen();
  EXPECT_FALSE(std::filesystem::exists(mark));
}

// A backup is put in its place, or somebody vacuums: the mark is wrong, but the rows are sound.
TEST(CleanEnd, AnotherFileInItsPlaceIsCheckedWhole) {
  CellDatabase cell;
  fill(cell);
  const auto copy = cell.file().string() + ".copy";
  tamper(cell.file(), "VACUUM INTO '" + copy + "'");
  { const Database closed = std::move(cell.database()); }
  std::filesystem::rename(copy, cell.file());
  cell.reopen();
  EXPECT_EQ(must(cell.jobs().list()).size(), 3U);
}

// SQLite takes an empty file for a new database: all wood would be free.
TEST(CleanEnd, AnEmptyFileIsRefusedWhereADatabaseWas) {
  for (const bool killed : {false, true}) {
    CellDatabase cell;
    fill(cell);
    { const Database closed = std::move(cell.database()); }
    if (killed) std::filesystem::remove(cell.file().string() + ".clean");
    write_file(cell.file(), "");
    const auto opened = Database::open(cell.file());
    ASSERT_FALSE(opened.ok());
    EXPECT_THAT(opened.error().message, HasSubstr("is damaged (it is empty)"));
    // Whoever wants to begin anew removes it.
    std::filesystem::remove(cell.file());
    EXPECT_TRUE(Database::open(cell.file()).ok());
  }
  // A first start that was killed before it had written anything.
  const testing::TempDirectory directory;
  write_file(directory / "veneerd.db", "");
  EXPECT_TRUE(Database::open(directory / "veneerd.db").ok());
}

TEST(CleanEnd, ADamagedRowIsNamedByItsTable) {
  CellDatabase cell;
  fill(cell);
  { const Database closed = std::move(cell.database()); }
  std::string bytes = read_file(cell.file());
  const auto at = bytes.find("the lid was opened");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'T';
  write_file(cell.file(), bytes);
  const auto opened = Database::open(cell.file());
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_THAT(opened.error().message, HasSubstr("1 of the rows of runs is not what was written"));
  EXPECT_THAT(opened.error().message, HasSubstr("put a backup in its place"));
}

}  // namespace
}  // namespace veneer::db
