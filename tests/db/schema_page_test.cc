// docs/SCHEMA.md draws the database as it is: its diagrams are read and held against the schema.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "db/sql.h"
#include "tests/db/everything.h"
#include "tests/db/filled_cell.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using Arrows = std::set<std::pair<std::string, std::string>>;

struct Diagram {
  std::string kind;             // the first word: "flowchart", "stateDiagram-v2"
  std::set<std::string> names;  // of what an arrow begins or ends at, or what is listed with semicolons
  Arrows arrows;                // --> alone; a dotted one is none
};

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

void read_line(const std::string& line, Diagram& diagram) {
  if (const auto arrow = line.find(" --> "); arrow != std::string::npos) {
    const std::string from = trimmed(line.substr(0, arrow));
    const std::string to = trimmed(line.substr(arrow + 5, line.find(':', arrow) - arrow - 5));
    diagram.arrows.insert({from, to});
    diagram.names.insert({from, to});
  } else if (line.find(';') != std::string::npos) {
    std::istringstream listed(line);
    for (std::string name; std::getline(listed, name, ';');) diagram.names.insert(trimmed(name));
  }
}

std::vector<Diagram> diagrams() {
  std::ifstream page(VENEER_SOURCE "/docs/SCHEMA.md");
  std::vector<Diagram> out;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("```")) {
      inside = line == "```mermaid";
      if (inside) out.emplace_back();
    } else if (inside && out.back().kind.empty()) {
      out.back().kind = line.substr(0, line.find(' '));
    } else if (inside) {
      read_line(line, out.back());
    }
  }
  return out;
}

// The page's queries, for whoever reads the database with the sqlite3 shell.
std::vector<std::string> queries() {
  std::ifstream page(VENEER_SOURCE "/docs/SCHEMA.md");
  std::vector<std::string> out;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line == "```sql") out.emplace_back();
    if (!inside && line == "```sql")
      inside = true;
    else if (line == "```")
      inside = false;
    else if (inside)
      out.back() += line + "\n";
  }
  return out;
}

class SchemaPage : public ::testing::Test {
 protected:
  Arrows pairs(const std::string& query) {
    Arrows out;
    // veneerd's own connections do not let anybody ask for the schema's keys.
    SQLite::Database reading(cell_.file().string(), SQLite::OPEN_READONLY);
    SQLite::Statement rows(reading, query);
    while (rows.executeStep()) out.insert({rows.getColumn(0).getString(), rows.getColumn(1).getString()});
    return out;
  }
  // The diagram of states in which this one is.
  static Arrows moves_with(const std::string& state) {
    for (const Diagram& diagram : diagrams())
      if (diagram.kind == "stateDiagram-v2" && diagram.names.contains(state)) {
        Arrows out = diagram.arrows;
        std::erase_if(out, [](const auto& arrow) { return arrow.first == "[*]"; });
        return out;
      }
    return {};
  }
  CellDatabase cell_;
};

TEST_F(SchemaPage, DrawsEveryTableAndEveryReference) {
  const auto all = diagrams();
  ASSERT_FALSE(all.empty());
  const Diagram& tables = all.front();
  ASSERT_EQ(tables.kind, "flowchart");
  std::set<std::string> there;
  for (const auto& [name, type] : pairs("SELECT name, type FROM sqlite_schema WHERE type IN ('table', 'view') AND name "
                                        "NOT LIKE 'sqlite%' AND name NOT LIKE 'allocation_boxes%' AND name NOT LIKE "
                                        "'%_moves'"))
    there.insert(name);
  EXPECT_EQ(tables.names, there);
  EXPECT_EQ(tables.arrows,
            pairs("SELECT t.name, f.\"table\" FROM sqlite_schema AS t, pragma_foreign_key_list(t.name) AS "
                  "f WHERE t.type = 'table' AND t.name <> f.\"table\""));
}

TEST_F(SchemaPage, DrawsTheMovesOfAJobAndOfWood) {
  EXPECT_EQ(moves_with("planned"), pairs("SELECT from_state, to_state FROM job_moves"));
  EXPECT_EQ(moves_with("reserved"), pairs("SELECT from_state, to_state FROM allocation_moves"));
}

TEST_F(SchemaPage, DrawsWhatBecomesOfADifferenceAndOfALease) {
  const auto listed_in = [&](const std::string& table, const std::string& list, const std::string& before) {
    const auto sql = pairs("SELECT name, sql FROM sqlite_schema WHERE name = '" + table + "'").begin()->second;
    const auto from = sql.find(list);  // verdict IN ('written_off', ...)
    EXPECT_NE(from, std::string::npos) << table;
    Arrows out;
    std::istringstream listed(sql.substr(from, sql.find(')', from) - from));
    std::string word;
    for (bool quoted = false; std::getline(listed, word, '\''); quoted = !quoted)
      if (quoted) out.insert({before, word});
    EXPECT_EQ(out.size(), 4U) << table;
    return out;
  };
  EXPECT_EQ(moves_with("written_off"), listed_in("difference_verdicts", "verdict IN (", "open"));
  EXPECT_EQ(moves_with("spoilt"), listed_in("leases", "ended IN (", "lasting"));
}

TEST_F(SchemaPage, DrawsRunsAndRetirementsAsTheStoresMoveThem) {
  const Arrows runs = {{"on", "done"}, {"on", "stopped"}, {"on", "broken_off"}};
  EXPECT_EQ(moves_with("broken_off"), runs);
  const Arrows stock = {{"in_stock", "retired"}, {"retired", "in_stock"}};
  EXPECT_EQ(moves_with("in_stock"), stock);
  const PanelId panel = cell_.new_panel();
  VENEER_ASSERT_OK(cell_.panels().retire(panel, "split", kNow));
  EXPECT_FALSE(cell_.panels().retire(panel, "split", kNow).ok());
  VENEER_ASSERT_OK(cell_.panels().restore(panel, "glued", kLater));
  EXPECT_FALSE(cell_.panels().restore(panel, "glued", kLater).ok());
  // Each way that a run ends.
  for (const char* end : {"done", "stopped", "broken_off"}) {
    const std::string name = end;
    const double x = name == "done" ? 10 : name == "stopped" ? 60 : 110;
    const JobId job = must(cell_.jobs().create(
        job_of({square_piece("A1", panel, x, 10, 14), square_piece("A2", panel, x + 20, 10, 14)}), kNow));
    const RunId run = must(cell_.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
    const auto pieces = must(cell_.jobs().pieces(job));
    for (const PieceRecord& piece : pieces) {
      if (name != "done") continue;
      VENEER_ASSERT_OK(cell_.jobs().mark_cutting(piece.id, kNow));
      VENEER_ASSERT_OK(cell_.jobs().book_piece(piece.id, kNow));
    }
    if (name == "broken_off")
      VENEER_ASSERT_OK(cell_.jobs().abort_run(run, {}, "the lid was opened", kLater));
    else
      VENEER_ASSERT_OK(cell_.jobs().finish_run(run, false, kLater));
    EXPECT_EQ(must(cell_.jobs().runs(job)).at(0).result, name == "broken_off" ? "the lid was opened" : name);
  }
}

TEST_F(SchemaPage, DrawsRulesThatAreThere) {
  const auto all = diagrams();
  const auto rules = std::find_if(all.begin(), all.end(),
                                  [](const Diagram& d) { return d.names.contains("allocations_never_overlap"); });
  ASSERT_NE(rules, all.end());
  EXPECT_GT(rules->arrows.size(), 10U);
  const Arrows triggers = pairs("SELECT tbl_name, name FROM sqlite_schema WHERE type = 'trigger'");
  for (const auto& rule : rules->arrows) EXPECT_TRUE(triggers.contains(rule)) << rule.first << ": " << rule.second;
}

// Names under which others look for what tables of other names hold.
TEST_F(SchemaPage, ItsViewsTellOfEverythingThatHappened) {
  fill(cell_);
  SQLite::Database shell(cell_.file().string(), SQLite::OPEN_READONLY);
  for (const char* view : {"artworks", "registrations", "events"}) {
    SQLite::Statement rows(shell, std::string("SELECT * FROM ") + view);
    EXPECT_TRUE(rows.executeStep()) << view;
  }
  EXPECT_EQ(shell.execAndGet("SELECT sum(plans) FROM artworks").getInt(),
            shell.execAndGet("SELECT count(*) FROM plans WHERE target_file <> ''").getInt());
  EXPECT_EQ(shell.execAndGet("SELECT count(*) FROM events WHERE kind IN ('wood', 'verdict')").getInt(),
            shell.execAndGet("SELECT count(*) FROM allocation_history").getInt())
      << "a settled piece stands once";
  EXPECT_EQ(shell.execAndGet("SELECT count(*) FROM registrations").getInt(),
            shell.execAndGet("SELECT count(*) FROM scans").getInt());
  const std::set<std::string> kinds = {"wood",      "verdict",    "assembly", "run",      "job",
                                       "panel",     "scan",       "mask",     "cell",     "edit",
                                       "treatment", "difference", "lease",    "proposal", "merge"};
  std::set<std::string> told;
  for (const auto& [kind, none] : pairs("SELECT kind, '' FROM events")) told.insert(kind);
  EXPECT_EQ(told, kinds);
  EXPECT_TRUE(
      pairs("SELECT kind, '' FROM events WHERE at IS NULL OR step IS NULL OR what = '' OR who IS NULL").empty());
}

TEST_F(SchemaPage, ItsEventsTellWhatWasKeptScannedPaintedMergedAndSawn) {
  fill(cell_);
  VENEER_ASSERT_OK(in_transaction(cell_.database(), [](SQLite::Database& connection) -> Status {
    connection.exec(
        "INSERT INTO proposal_verdicts (proposal, verdict, overruled, panel, mask_version, who, note, at) "
        "VALUES (3, 'accepted', '[]', 'P-0005', 1, 'user anna', '', '2026-05-01T09:30:00.000Z')");
    return Ok();
  }));
  const auto told = [&](const char* kind) {
    return texts(cell_.database().connection(),
                 fmt::format("SELECT coalesce(panel, 'no panel') || ', ' || step || ': ' || what || ' by ' || who "
                             "FROM events WHERE kind = '{}' AND what NOT IN ('entered', 'started') "
                             "ORDER BY at, step, what",
                             kind));
  };
  EXPECT_THAT(told("lease"), ElementsAre("no panel, 1: plan 5 until 2026-05-01T08:30:00.000Z by local:1000",
                                         "no panel, 1: plan 5 expired by ",
                                         "no panel, 2: plan 5 until 2026-05-08T08:30:00.000Z by local:1000"));
  EXPECT_THAT(told("proposal"), ElementsAre("no panel, 1: replaced by local:1000", "no panel, 1: waits by local:1000",
                                            "no panel, 2: waits by local:1000", "P-0005, 3: waits by local:1000",
                                            "P-0003, 4: waits by local:1000", "no panel, 2: refused by local:1000",
                                            "P-0005, 3: accepted by user anna"))
      << "a first scan has the panel's name once it is accepted";
  EXPECT_THAT(told("edit"), ElementsAre("P-0003, 1: gives wood by local:1000", "P-0003, 2: taken back by local:1000",
                                        "P-0003, 2: withholds wood by local:1000"));
  EXPECT_THAT(told("merge"),
              ElementsAre("P-0006, 1: is P-0007 by local:1000", "P-0007, 1: was also P-0006 by local:1000"));
  EXPECT_THAT(told("panel"),
              ElementsAre("P-0003, 1: retired by ", "P-0003, 2: restored by ", "P-0004, 3: sawn apart by local:1000"))
      << "a merge stands once";
}

// Without this program's functions.
TEST_F(SchemaPage, ItsQueriesFindWhatTheySay) {
  fill(cell_);
  SQLite::Database shell(cell_.file().string(), SQLite::OPEN_READONLY);
  ASSERT_EQ(queries().size(), 3U);
  for (const std::string& query : queries()) {
    SQLite::Statement rows(shell, query);
    EXPECT_TRUE(rows.executeStep()) << query;
  }
}

}  // namespace
}  // namespace veneer::db
