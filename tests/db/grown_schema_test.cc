// Databases that were in use for years: every schema added rows of its own while it was the newest. Opened by the
// newest program, from whatever schema they had come to, they say what they said before.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <set>

#include "db/leases.h"
#include "db/materials.h"
#include "tests/db/everything.h"
#include "tests/db/old_rows.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::IsSubsetOf;

std::vector<std::string> columns_of(SQLite::Database& connection, const std::string& table) {
  return texts(connection, fmt::format("SELECT name FROM pragma_table_xinfo('{}') WHERE name <> 'checksum' AND hidden "
                                       "= 0 ORDER BY cid",
                                       table));
}

// Every row of a table, as one text each.
std::vector<std::string> rows_of(SQLite::Database& connection, const std::string& table,
                                 const std::vector<std::string>& columns) {
  std::string quoted;
  for (const auto& column : columns) quoted += fmt::format("{}quote({})", quoted.empty() ? "" : " || '|' || ", column);
  return texts(connection, fmt::format("SELECT {} FROM {} ORDER BY 1", quoted, table));
}

using Columns = std::map<std::string, std::vector<std::string>>;  // by table
Columns columns_in(SQLite::Database& connection) {
  // What may follow what, and the sums, are the program's own.
  const std::set<std::string> own = {"job_moves", "allocation_moves", "table_sums", "allocation_boxes"};
  Columns out;
  for (const auto& table : tables(connection))
    if (!own.contains(table)) out[table] = columns_of(connection, table);
  return out;
}
Columns newest_columns() {
  CellDatabase fresh;
  return columns_in(fresh.database().connection());
}

// What it says in the columns that the newest schema has, too; the others say it elsewhere, which is looked at on its
// own.
struct Said {
  std::vector<std::string> columns, rows;
};
std::map<std::string, Said> said_by(SQLite::Database& connection, const Columns& newest) {
  std::map<std::string, Said> out;
  for (auto [table, columns] : columns_in(connection)) {
    EXPECT_TRUE(newest.contains(table)) << table << " is gone";
    if (!newest.contains(table)) continue;
    const auto& there = newest.at(table);
    std::erase_if(columns,
                  [&](const auto& name) { return std::find(there.begin(), there.end(), name) == there.end(); });
    out[table] = {columns, rows_of(connection, table, columns)};
  }
  return out;
}

class GrownSchema : public ::testing::TestWithParam<int> {};

TEST_P(GrownSchema, SaysWhatItSaidBefore) {
  constexpr int kTablesAsTheyAre = 6;  // before, pieces and plans were told in other tables (old_schema_test.cc)
  const int version = GetParam();
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  std::map<std::string, Said> before;
  {
    SQLite::Database old(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    grow(old, version);
    if (::testing::Test::HasFatalFailure()) return;
    if (version >= kTablesAsTheyAre) before = said_by(old, newest_columns());
  }
  Database database = must(Database::open(file));
  EXPECT_EQ(database.schema_version(), migrations().back().version);
  VENEER_EXPECT_OK(database.check_integrity());
  SQLite::Database& now = database.connection();
  // A new schema may add rows, as histories were.
  for (const auto& [table, said] : before)
    EXPECT_THAT(said.rows, IsSubsetOf(rows_of(now, table, said.columns))) << table;

  const auto live = must(Ledger(database).allocations({"P-0001"}, {0}, 100));
  const auto led = std::find_if(live.begin(), live.end(), [](const auto& a) { return a.id.value == 25; });
  ASSERT_EQ(led != live.end(), version >= 3);
  if (version >= 3) {
    EXPECT_EQ(led->outline, (Ring<PanelFrame>{point<PanelFrame>(60, 0), point<PanelFrame>(69, 0),
                                              point<PanelFrame>(69, 9), point<PanelFrame>(60, 9)}));
    EXPECT_NEAR(led->lead_in.area().count(), 1.2 * 0.3, 0.003 * 0.3 + 1e-9) << "but for 3 um where it meets the band";
    EXPECT_NEAR(kerf_of(*led).area().count(), 9.6 * 9.6 - 81, 0.003 * 0.3 + 1e-9);
  }
  const auto zones = must(Materials(database).zones({"P-0001"}));
  ASSERT_EQ(!zones.empty(), version >= 2);
  if (version >= 2) {
    const Ring<PanelFrame> hull = {point<PanelFrame>(0, 0), point<PanelFrame>(200, 0), point<PanelFrame>(200, 280),
                                   point<PanelFrame>(0, 280)};
    EXPECT_EQ(zones[0].shape.rings(), Region<PanelFrame>(hull).rings()) << "the ring around its strip";
    EXPECT_EQ(zones[0].material, "oak");
    EXPECT_EQ(zones[0].version, 1);
  }
  for (const auto& booked : live) {
    EXPECT_TRUE(booked.id.value >= 24 || (booked.lead_in.empty() && booked.outline.size() == 3)) << booked.id.value;
  }
  if (version >= 19) {
    const auto part = must(Ledger(database).live_allocations({"P-0004"}));
    ASSERT_EQ(part.size(), 1U);
    EXPECT_EQ(part[0].outline,
              (Ring<PanelFrame>{point<PanelFrame>(53, 1), point<PanelFrame>(59, 1), point<PanelFrame>(59, 7)}));
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, GrownSchema, ::testing::Range(1, static_cast<int>(migrations().size())));

// Every table of the newest schema is filled by one of these rows.
TEST(GrownSchemaRows, LeaveNoTableEmpty) {
  const testing::TempDirectory directory;
  SQLite::Database old((directory / "veneerd.db").string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  grow(old, static_cast<int>(migrations().size()));
  for (const auto& [table, said] : said_by(old, newest_columns())) EXPECT_FALSE(said.rows.empty()) << table;
}

// Before schema 35 no verdict told who had given up a cut piece: the plan that placed it anew at that instant does.
TEST(GrownSchemaRows, TellWhoGaveUpAPieceThatWasCut) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  {
    SQLite::Database old(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    grow(old, 34);
  }
  Database database = must(Database::open(file));
  EXPECT_THAT(texts(database.connection(),
                    "SELECT v.allocation || ' ' || v.verdict || ' ' || v.as_seen || ' ' || v.who || ' ' || v.at || ' ' "
                    "|| h.state FROM verdicts AS v JOIN allocation_history AS h ON h.id = v.step ORDER BY v.id"),
              ElementsAre("21 cut 0 local:1000 t27 cut", "22 scrap 0 user bert t28 scrap",
                          "21 scrap 0 user anna t28 scrap", "30 scrap 0 user carl t30 scrap"));
  EXPECT_THAT(texts(database.connection(),
                    "SELECT kind || ' ' || what || ' ' || who FROM events WHERE panel = 'P-0001' AND at = 't28'"),
              ElementsAre("verdict scrap user anna"))
      << "once";
}

}  // namespace
}  // namespace veneer::db
