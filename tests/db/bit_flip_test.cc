// A disk that forgets single bits: whatever it changes of what counts, the database is refused at its next start; where
// it is taken, everything in it is as it was written. `./dev soak ledger` runs more, with fresh seeds (VENEER_SEED,
// VENEER_FLIPS).
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/db/filled_cell.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

std::uint32_t number_from(const char* variable, std::uint32_t otherwise) {
  const char* text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe)
  return text == nullptr ? otherwise : static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10));
}

std::string read_file(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}
void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::vector<std::string> texts(SQLite::Database& connection, const std::string& query) {
  SQLite::Statement rows(connection, query);
  std::vector<std::string> out;
  while (rows.executeStep()) out.push_back(rows.getColumn(0).getString());
  return out;
}
std::vector<std::string> tables(SQLite::Database& connection) {
  return texts(connection,
               "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%' AND name NOT LIKE "
               "'allocation_boxes_%' ORDER BY name");
}

// Every value of every row of every table, of the schema and of the header's fields that we use.
std::string everything_in(SQLite::Database& connection) {
  std::string out;
  const auto add = [&](const std::string& query) {
    SQLite::Statement rows(connection, query);
    while (rows.executeStep())
      for (int i = 0; i < rows.getColumnCount(); ++i)
        out += rows.getColumn(i).isNull() ? "null|" : rows.getColumn(i).getString() + "|";
  };
  for (const auto& table : tables(connection)) add("SELECT * FROM " + table + " ORDER BY 1, 2, 3");
  add("SELECT type, name, tbl_name, sql FROM sqlite_schema ORDER BY name");
  add("SELECT s.name, s.seq FROM sqlite_sequence AS s ORDER BY s.name");
  add("PRAGMA user_version");
  add("PRAGMA application_id");
  return out;
}

class BitFlipTest : public ::testing::Test {
 protected:
  void SetUp() override {
    {
      CellDatabase cell;
      fill(cell);
      file_ = cell.file();
      SQLite::Database& connection = cell.database().connection();
      wanted_ = everything_in(connection);
      for (const auto& table : tables(connection))
        for (const auto& column : texts(connection, "SELECT name FROM pragma_table_info('" + table + "')"))
          for (const auto& value : texts(connection, fmt::format("SELECT {} FROM {}", column, table)))
            if (value.size() >= 3) values_.push_back(value);
      { const Database closed = std::move(cell.database()); }
      bytes_ = read_file(file_);
      mark_ = read_file(file_.string() + ".clean");
      cell.reopen();
    }
    file_ = directory_ / "veneerd.db";
  }

  enum class Outcome { kRefused, kUnchanged, kTaken };
  // The file with one bit changed, opened and read as a daemon would.
  Outcome open_with_flip(std::size_t at, int bit, bool marked) {
    std::string changed = bytes_;
    changed[at] = static_cast<char>(changed[at] ^ (1 << bit));
    for (const char* beside : {"-wal", "-shm", ".clean"}) std::filesystem::remove(file_.string() + beside);
    write_file(file_, changed);
    if (marked) write_file(file_.string() + ".clean", mark_);
    auto opened = Database::open(file_);
    if (!opened.ok()) return Outcome::kRefused;
    try {
      return everything_in(opened->connection()) == wanted_ ? Outcome::kUnchanged : Outcome::kTaken;
    } catch (const SQLite::Exception&) {
      return Outcome::kTaken;  // it was said to be sound
    }
  }

  testing::TempDirectory directory_;
  std::filesystem::path file_;
  std::string bytes_, mark_, wanted_;
  std::vector<std::string> values_;  // as they are stored
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
  const std::uint32_t flips = number_from("VENEER_FLIPS", 150);
  std::uint32_t refused = 0, unchanged = 0;
  for (std::uint32_t i = 0; i < flips; ++i) {
    const std::string& value = values_[random() % values_.size()];
    std::vector<std::size_t> places;
    for (auto at = bytes_.find(value); at != std::string::npos; at = bytes_.find(value, at + 1)) places.push_back(at);
    if (places.empty()) continue;  // a number
    const std::size_t at = places[random() % places.size()] + random() % value.size();
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
  const std::uint32_t flips = number_from("VENEER_FLIPS", 150);
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
