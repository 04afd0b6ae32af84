// docs/SCHEMA.md draws the database as it is: its diagrams are read and held against the schema.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
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
  const std::set<std::string> kinds = {"wood",  "verdict",  "assembly", "run",     "job",       "panel",
                                       "scan",  "mask",     "cell",     "edit",    "treatment", "difference",
                                       "lease", "proposal", "merge",    "remnant", "sighting"};
  std::set<std::string> told;
  for (const auto& [kind, none] : pairs("SELECT kind, '' FROM events")) told.insert(kind);
  EXPECT_EQ(told, kinds);
  EXPECT_TRUE(pairs("SELECT kind, '' FROM events WHERE at IS NULL OR step IS NULL OR coalesce(what, '') = '' OR "
                    "who IS NULL")
                  .empty());
}

// Whatever has a time happened: it stands in the list of events, or the page says that it does not.
TEST_F(SchemaPage, ItsEventsTellOfEachTableWithATimeOrThePageNamesItAsLeftOut) {
  const std::set<std::string> left_out = {
      "audit",  "certificates", "credentials", "lasers",       "material_facts", "panel_facts",  "plans",
      "proofs", "queue_orders", "recipes",     "request_keys", "users",          "zone_versions"};
  const std::string view = pairs("SELECT 'events', sql FROM sqlite_schema WHERE name = 'events'").begin()->second;
  std::set<std::string> untold;
  for (const auto& [table, column] :
       pairs("SELECT t.name, c.name FROM sqlite_schema AS t, pragma_table_info(t.name) AS c WHERE t.type = 'table' AND "
             "t.name NOT LIKE 'sqlite%' AND (c.name = 'at' OR c.name LIKE '%~_at' ESCAPE '~')"))
    if (!std::regex_search(view, std::regex("(FROM|JOIN) " + table + "\\b"))) untold.insert(table);
  EXPECT_EQ(untold, left_out);
  std::ifstream page(VENEER_SOURCE "/docs/SCHEMA.md");
  const std::string text((std::istreambuf_iterator<char>(page)), {});
  const auto from = text.find("Not in **events** are "), to = text.find("```sql", from);
  ASSERT_NE(to, std::string::npos);
  for (const std::string& table : left_out)
    EXPECT_NE(text.substr(from, to - from).find("**" + table + "**"), std::string::npos) << table;
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
  EXPECT_THAT(told("lease"), ElementsAre("no panel, 1: lease of plan 5 until 2026-05-01T08:30:00.000Z by local:1000",
                                         "no panel, 1: lease of plan 5 expired by ",
                                         "no panel, 2: lease of plan 5 until 2026-05-08T08:30:00.000Z by local:1000"));
  EXPECT_THAT(told("proposal"), ElementsAre("no panel, 1: made by local:1000", "no panel, 1: replaced by local:1000",
                                            "no panel, 2: made by local:1000", "P-0005, 3: made by local:1000",
                                            "P-0003, 4: made by local:1000", "no panel, 2: refused by local:1000",
                                            "P-0005, 3: accepted by user anna"))
      << "a first scan has the panel's name once it is accepted";
  EXPECT_THAT(told("edit"), ElementsAre("P-0003, 1: gives wood by local:1000", "P-0003, 2: taken back by local:1000",
                                        "P-0003, 2: withholds wood by local:1000"));
  EXPECT_THAT(told("merge"),
              ElementsAre("P-0006, 1: is P-0007 by local:1000", "P-0007, 1: was also P-0006 by local:1000"));
  EXPECT_THAT(told("panel"), ElementsAre("P-0003, 1: retired by user anna", "P-0003, 2: restored by ",
                                         "P-0004, 3: sawn apart by local:1000"))
      << "a merge stands once";
  EXPECT_THAT(told("remnant"), ElementsAre("P-0001, 1: booked by "));
  EXPECT_THAT(told("sighting"), ElementsAre("P-0001, 1: looks cut by "));
  const auto put_back = texts(cell_.database().connection(),
                              "SELECT kind || ': ' || what || ' by ' || who FROM events WHERE what LIKE '%backup%'");
  EXPECT_THAT(put_back, ElementsAre("cell: backup of " + kNow + " put back by uid 1000"));
}

TEST_F(SchemaPage, ItsEventsTellHowALeaseEnded) {
  const PanelId panel = cell_.new_panel();
  Plans plans(cell_.database());
  Leases leases(cell_.database());
  const auto plan_at = [&](const char* mark, double x) {
    return must(plans.add(job_of({square_piece(mark, panel, x, 40, 14)}), kNow));
  };
  const PlanId taken = plan_at("A1", 20), released = plan_at("B1", 60), spoilt = plan_at("C1", 100);
  for (const PlanId plan : {taken, released, spoilt}) must(leases.take(plan, "local:1000", kNow, kLater));
  must(cell_.jobs().create(taken, kNow));
  VENEER_ASSERT_OK(leases.release(released, kNow, "user anna"));
  Differences differences(cell_.database());
  DifferenceRecord gone;
  gone.gone = true, gone.place = point<PanelFrame>(107, 47), gone.area = SquareMillimetres(16);
  gone.shape = rectangle(105, 45, 4, 4);
  VENEER_ASSERT_OK(differences.found(panel, {gone}, kNow));
  VENEER_ASSERT_OK(differences.decide(panel, {1}, DifferenceVerdict::kWrittenOff, "local:1000", "a chip", kNow));
  EXPECT_THAT(
      texts(cell_.database().connection(),
            "SELECT what || ' by ' || who FROM events WHERE kind = 'lease' AND what NOT LIKE '% until %' ORDER BY "
            "step"),
      ElementsAre("lease of plan 1 became a job by ", "lease of plan 2 was released by user anna",
                  "lease of plan 3 ended, its wood was written off by "));
}

// A part has what was booked and done to its parent in rows of its own, and a panel the wood of what was merged into
// it.
TEST_F(SchemaPage, ItsEventsTellOnceWhatPartsAndMergedPanelsCarryOver) {
  fill(cell_);
  EXPECT_THAT(texts(cell_.database().connection(),
                    "SELECT panel || ': ' || what FROM events WHERE kind = 'wood' AND job IS NULL AND what LIKE "
                    "'%scrap' ORDER BY panel"),
              ElementsAre("P-0001: scrap", "P-0004: scrap", "P-0005: carried over: scrap", "P-0006: scrap",
                          "P-0007: carried over: scrap"));
  const PanelId sawn = cell_.new_panel();
  StockFacts facts(cell_.database());
  const auto treat = [&](const PanelId& panel, const char* product, const std::string& at) {
    VENEER_ASSERT_OK(facts.set_panel(panel, {{}, {}, {}, "local:1000", at},
                                     {{TreatmentKind::kSanding, product, "2026-04-30", "", ""}}));
  };
  treat(sawn, "grit 120", "2026-04-30T07:30:00.000Z");
  VENEER_ASSERT_OK(cell_.panels().split(sawn, "local:1000", "sawn apart", kNow));
  PanelRecord part = sheet(must(cell_.panels().next_panel_id()));
  part.parent = sawn, part.created_at = kLater;
  const Isometry2<PanelFrame, PanelFrame> as_it_lay(degrees(0), point<PanelFrame>(0, 0));
  VENEER_ASSERT_OK(cell_.panels().add_part(part, {}, {}, {as_it_lay, 3, 0.02_mm}));
  treat(part.id, "grit 240", kLater);
  EXPECT_EQ(must(facts.treatments(part.id)).size(), 2U);
  EXPECT_THAT(texts(cell_.database().connection(),
                    fmt::format("SELECT panel || ' ' || at FROM events WHERE kind = 'treatment' AND panel IN ('{}', "
                                "'{}') ORDER BY at",
                                sawn.value, part.id.value)),
              ElementsAre(sawn.value + " 2026-04-30T07:30:00.000Z", part.id.value + " " + kLater));
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
