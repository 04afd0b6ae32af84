// The audit log tells of its own changes: what somebody changes, removes, adds or moves in it is named by the check.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "db/audit.h"
#include "db/audit_chain.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

// As somebody who knows the program's functions and drops what stands in his way, and puts it back afterwards.
void tamper_with_audit(const std::filesystem::path& file, const std::string& sql) {
  SQLite::Database connection(file.string(), SQLite::OPEN_READWRITE, 5000);
  register_functions(connection);
  std::vector<std::string> triggers;
  {
    SQLite::Statement rows(
        connection,
        "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger' AND tbl_name = 'audit' AND name NOT LIKE "
        "'sums%'");
    std::vector<std::string> names;
    while (rows.executeStep()) {
      names.push_back(rows.getColumn(0).getString());
      triggers.push_back(rows.getColumn(1).getString());
    }
    rows.reset();
    for (const auto& name : names) connection.exec("DROP TRIGGER " + name);
  }
  connection.exec(sql);
  for (const auto& trigger : triggers) connection.exec(trigger);
}

class AuditChainTest : public ::testing::Test {
 protected:
  void append(int rows) {
    for (int i = 0; i < rows; ++i)
      VENEER_ASSERT_OK(audit().append({0, kNow, "uid 1000", "job.start", std::to_string(++written_)}));
  }
  Audit audit() { return Audit(cell.database()); }
  std::string fault_after(const std::string& sql) {
    tamper_with_audit(cell.file(), sql);
    const Status checked = cell.database().check_integrity();
    return checked.ok() ? "" : checked.error().message;
  }

  CellDatabase cell;
  int written_ = 0;
};

// Computed by hand, with sha256sum: whoever reads docs/SCHEMA.md can check the chain without this program.
TEST_F(AuditChainTest, TheHashIsWhatTheDocumentationSays) {
  VENEER_ASSERT_OK(audit().append({0, kNow, "uid 1000", "job.start", "7"}));
  VENEER_ASSERT_OK(audit().append({0, kLater, "veneerd", "cell.recover", "job 7 aborted, \"A1\"\n"}));
  const auto rows = must(audit().latest(2));
  EXPECT_EQ(rows[1].hash, "e4fe04a2cd5aa4ce8b68f43c4c272b5af94b48d1b8fab92617e166c30cdb2fd3");
  EXPECT_EQ(rows[0].hash, "dde2195f77e926160b40f4c309fa647afec6bcad4e10118d436148e80f5ad183");
  const AuditHead head = must(audit().head());
  EXPECT_EQ(head.id, 2);
  EXPECT_EQ(head.hash, rows[0].hash);
}

TEST_F(AuditChainTest, TheRowThatDoesNotFollowIsNamed) {
  append(20);
  EXPECT_THAT(fault_after("UPDATE audit SET detail = '99' WHERE id = 17"),
              HasSubstr("audit row 17 does not follow from row 16"));
}

TEST_F(AuditChainTest, ARowThatIsGoneIsNoticedAtTheNext) {
  append(20);
  EXPECT_THAT(fault_after("DELETE FROM audit WHERE id = 17"), HasSubstr("audit row 18 does not follow from row 16"));
}

TEST_F(AuditChainTest, LastRowsThatAreGoneAreNoticedAndNoRowTakesTheirPlace) {
  append(20);
  EXPECT_THAT(fault_after("DELETE FROM audit WHERE id > 18"),
              HasSubstr("audit row 18 is the last, but row 20 was written"));
  const Status next = audit().append({0, kNow, "uid 1000", "job.start", ""});
  ASSERT_FALSE(next.ok());
  EXPECT_EQ(next.error().code, ErrorCode::kStorage);
}

TEST_F(AuditChainTest, TheFirstRowBeginsTheLog) {
  append(3);
  EXPECT_THAT(fault_after("DELETE FROM audit WHERE id = 1"), HasSubstr("audit row 2 does not begin the audit log"));
}

TEST_F(AuditChainTest, ARowThatDoesNotFollowIsNotTaken) {
  append(3);
  EXPECT_FALSE(execute(cell.database(),
                       "INSERT INTO audit (at, who, what, detail, hash) SELECT at, who, what, detail, hash FROM audit "
                       "WHERE id = 3")
                   .ok());
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

// Rewritten from one row on, by somebody who computes the hashes anew: only the head that was written down tells.
TEST_F(AuditChainTest, ARewrittenLogHasAnotherHead) {
  append(5);
  const AuditHead head = must(audit().head());
  EXPECT_EQ(
      fault_after("UPDATE audit SET detail = 'another', hash = veneer_audit_hash((SELECT hash FROM audit WHERE id "
                  "= 4), id, at, who, what, 'another') WHERE id = 5"),
      "");
  EXPECT_NE(must(audit().head()).hash, head.hash);
}

TEST_F(AuditChainTest, IsReadByTimePersonAndPanel) {
  for (const char* panel : {"P-1000", "P-10000"})
    VENEER_ASSERT_OK(
        audit().append({0, kNow, "uid 1000", "api.retirePanel", "POST /api/v1/panels/" + std::string(panel)}));
  VENEER_ASSERT_OK(audit().append({0, kLater, "uid 7", "api.scan", R"(POST /api/v1/scans {"panel":"P-1000"})"}));
  const auto ids = [this](const AuditFilter& filter) {
    std::vector<std::int64_t> out;
    for (const auto& row : must(audit().read(filter, 100))) out.push_back(row.id);
    return out;
  };
  using Ids = std::vector<std::int64_t>;
  EXPECT_EQ(ids({}), (Ids{3, 2, 1}));
  EXPECT_EQ(ids({.since = kLater}), (Ids{3}));
  EXPECT_EQ(ids({.who = "uid 1000"}), (Ids{2, 1}));
  EXPECT_EQ(ids({.panel = PanelId{"P-1000"}}), (Ids{3, 1}));
  EXPECT_EQ(ids({.panel = PanelId{"P-10000"}}), (Ids{2}));
  EXPECT_EQ(ids({.panel = PanelId{"P-1000"}, .before = 3}), (Ids{1}));
  EXPECT_EQ(ids({.what = "api.retirePanel"}), (Ids{2, 1}));
  EXPECT_EQ(ids({.what = "api.retire"}), Ids());
}

// A log of twelve rows in a file of its own, made once.
const std::filesystem::path& written_log() {
  static const CellDatabase kCell;
  static const std::filesystem::path kCopy = [] {
    Database database = must(Database::open(kCell.file().parent_path() / "log.db"));
    const char* details[] = {"1", "11", "5:a,b", ""};
    for (int i = 0; i < 12; ++i)
      if (!Audit(database).append({0, kNow, i % 3 == 0 ? "uid 1" : "uid 10", "what", details[i % 4]})) std::abort();
    return database.file();
  }();
  return kCopy;
}

RC_GTEST_PROP(AuditChain, AnyChangeOfAnyRowIsFound, ()) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  std::filesystem::copy_file(written_log(), file);
  constexpr int kRows = 12;
  const int row = *rc::gen::inRange(1, kRows + 1);
  const std::string column = *rc::gen::element<std::string>("at", "who", "what", "detail", "hash", "id", "all");
  std::string change;
  if (column == "id") {
    // Two rows change places, each with all that it holds.
    const int other = *rc::gen::distinctFrom(rc::gen::inRange(1, kRows + 1), row);
    change = fmt::format(
        "UPDATE audit SET id = -1 WHERE id = {0}; UPDATE audit SET id = {0} WHERE id = {1}; UPDATE audit SET id = {1} "
        "WHERE id = -1",
        row, other);
  } else if (column == "all") {
    change = fmt::format("DELETE FROM audit WHERE id = {}", row);
  } else if (column == "hash") {
    change = fmt::format("UPDATE audit SET hash = replace(hex(zeroblob(32)), '0', 'a') WHERE id = {}", row);
  } else if (*rc::gen::arbitrary<bool>()) {
    change = fmt::format("UPDATE audit SET {0} = {0} || '0' WHERE id = {1}", column, row);
  } else {
    // From one column to the next: "uid 1" "0what" is not "uid 10" "what".
    change = fmt::format("UPDATE audit SET who = who || substr(what, 1, 1), what = substr(what, 2) WHERE id = {}", row);
  }
  tamper_with_audit(file, change);
  SQLite::Database connection(file.string(), SQLite::OPEN_READONLY);
  register_functions(connection);
  const Status checked = check_chain(connection, file.string());
  RC_ASSERT(!checked.ok());
  RC_ASSERT(checked.error().message.find("audit row ") != std::string::npos);
}

// Asked at a start: each choice is noted before it is kept, and again when it could not be.
TEST_F(AuditChainTest, ChoicesOfDevicesThatWereKeptAreKnownWithoutAWalkThroughTheLog) {
  const auto chosen = [this] { return must(audit().devices_were_chosen()); };
  const auto note = [this](const char* what) {
    VENEER_ASSERT_OK(audit().append({0, kNow, "uid 1000", what, "camera"}));
  };
  EXPECT_FALSE(chosen());
  append(1);
  const int before = cell.pages_for(chosen);
  append(400);
  EXPECT_FALSE(chosen());
  EXPECT_LE(cell.pages_for(chosen), before);
  note(kDeviceChosen);
  note(kDeviceNotChosen);
  EXPECT_FALSE(chosen()) << "the disk was full";
  note(kDeviceChosen);
  EXPECT_TRUE(chosen());
  note(kDeviceChosen);
  note(kDeviceNotChosen);
  EXPECT_TRUE(chosen()) << "what was chosen before that is still kept";
}

}  // namespace
}  // namespace veneer::db
