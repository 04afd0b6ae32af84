// What the cell keeps on record, as a person asks for it: who did what, tables for a spreadsheet, and all of it on
// another machine.
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>

#include "daemon/stock/panel_library.h"
#include "db/sql.h"
#include "tests/support/lone_daemon.h"
#include "tests/support/stocked_database.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kWildName = "=HYPERLINK(\"http://x\"), oak";

fs::path programs() { return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin"; }

// Three panels, the third with a name that a spreadsheet would run; five pieces of one job are placed on the others.
Status stock(const fs::path& data) {
  boost::asio::io_context reactor;
  auto database = daemon::DatabaseThread::open(data / "veneerd.db", reactor);
  if (!database) return database.error();
  const auto wood =
      daemon::PanelLibrary(data).store_picture(cv::Mat(60, 90, CV_8UC1, cv::Scalar(255)), "panels", "mask");
  if (!wood) return wood.error();
  if (Status stocked = stock_two_panels(**database, 3, 2); !stocked) return stocked;
  return (*database)->call([&](daemon::Repositories& r) -> Status {
    for (const char* panel : {"P-0001", "P-0002"})
      if (auto mask = r.panels.add_mask(PanelId{panel}, {0, wood->file, wood->file, wood->sha256, kThen}, 1); !mask)
        return mask.error();
    db::PanelRecord panel;
    panel.id = PanelId{"P-0003"};
    panel.name = kWildName;
    panel.width = 90_mm, panel.height = 60_mm;
    panel.map_file = panel.mask_file = wood->file, panel.map_hash = wood->sha256;
    panel.created_at = kThen;
    if (Status added = r.panels.add(panel, {}, {}); !added) return added;
    const Ring<PanelFrame> half = {point<PanelFrame>(0, 0), point<PanelFrame>(45, 0), point<PanelFrame>(45, 60)};
    return r.materials.add_zones(panel.id, {{1, Region<PanelFrame>(half), "walnut"},
                                            {2, Region<PanelFrame>(half), ""},
                                            {3, Region<PanelFrame>(half), "maple"}});
  });
}

class Records : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(data);
    ASSERT_TRUE(stock(data).ok());
    begin(cell, data);
  }
  void begin(LoneDaemon& daemon, const fs::path& folder) const {
    LoneDaemonOptions options;
    options.data = folder;
    const Status started = daemon.start(
        programs(), "kind = \"lihuiyu\"\nport = \"file:" + (directory / "wire").string() + "\"\n", options);
    ASSERT_TRUE(started.ok()) << started.error().message;
  }
  json asked(std::vector<std::string> arguments) const {
    arguments.emplace_back("--json");
    const Finished told = cell.veneerctl(std::move(arguments));
    EXPECT_EQ(told.status, 0) << told.output;
    return json::parse(told.output, nullptr, false);
  }
  std::string head() const {
    const json at = asked({"audit", "--limit", "1"})["head"];
    return fmt::format("{}:{}", at["id"].get<int>(), at["hash"].get<std::string>());
  }
  // Rows of a CSV file as another program reads them.
  static json rows_of(const fs::path& file) {
    const Finished read = run_program(
        {"/usr/bin/env", "python3", "-c",
         ("import csv, json, sys; "
          "print(json.dumps(list(csv.DictReader(open(sys.argv[1], newline='', encoding='utf-8'), strict=True))))"),
         file.string()});
    EXPECT_EQ(read.status, 0) << read.output;
    return json::parse(read.output, nullptr, false);
  }

  testing::TempDirectory directory{testing::TempDirectory::Place::kDisk};
  const fs::path data = directory / "data";
  LoneDaemon cell;
};

TEST_F(Records, TheAuditLogTellsWhoDidWhatAndWhatCameOfIt) {
  ASSERT_EQ(cell.veneerctl({"panel", "retire", "P-0003", "--reason", "warped"}).status, 0);
  ASSERT_EQ(cell.veneerctl({"db", "backup"}).status, 0);
  std::vector<std::string> told;
  // What came of a task is written once its client knows, on a thread that may wait for a disk.
  json audit;
  const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  do {
    audit = asked({"audit", "--who", fmt::format("uid {}", getuid())});
  } while (audit["entries"].size() < 3 && std::chrono::steady_clock::now() < soon);
  for (const json& row : audit["entries"]) told.push_back(row["what"]);
  EXPECT_THAT(told, ElementsAre("api.makeBackup.done", "api.makeBackup", "api.retirePanel"));
  EXPECT_THAT(audit["entries"][0].value("detail", ""), HasSubstr("\"folder\":\"" + (data / "backups").string()));
  EXPECT_THAT(audit["entries"][2].value("detail", ""), HasSubstr("warped"));
  EXPECT_EQ(asked({"audit", "--panel", "P-0003"})["entries"].size(), 1U);
  EXPECT_EQ(asked({"audit", "--panel", "P-0001"})["entries"].size(), 0U);
  EXPECT_EQ(asked({"audit", "--since", "2999-01-01"})["entries"].size(), 0U);
  // From one answer: the cell writes alarms of its own into the log at any time.
  const json whole = asked({"audit", "--all"})["entries"];
  ASSERT_FALSE(whole.empty());
  EXPECT_EQ(whole.size(), whole[0]["id"]);
  const Finished wrong = cell.veneerctl({"audit", "--since", "yesterday"});
  EXPECT_EQ(wrong.status, 1);
  EXPECT_THAT(wrong.output, HasSubstr("give it in UTC"));
}

// Somebody stops the daemon and rewrites what he did, with the program's own functions, so that every row follows.
TEST_F(Records, ARewrittenAuditLogIsFoundByTheHeadThatWasWrittenDown) {
  ASSERT_EQ(cell.veneerctl({"panel", "retire", "P-0003", "--reason", "warped"}).status, 0);
  const std::string then = head();
  ASSERT_EQ(cell.veneerctl({"panel", "restore", "P-0003", "--reason", "flat again"}).status, 0);
  const Finished same = cell.veneerctl({"db", "check", "--audit-head", then});
  EXPECT_EQ(same.status, 0) << same.output;
  EXPECT_THAT(same.output, HasSubstr("as it was written down"));
  cell.end();
  {
    SQLite::Database raw((data / "veneerd.db").string(), SQLite::OPEN_READWRITE);
    db::register_functions(raw);
    std::vector<std::string> triggers;
    {
      SQLite::Statement each(raw,
                             "SELECT sql FROM sqlite_schema WHERE type = 'trigger' AND tbl_name = 'audit' AND name NOT "
                             "LIKE 'sums%'");
      while (each.executeStep()) triggers.push_back(each.getColumn(0).getString());
    }
    for (const char* name : {"audit_rows_follow", "audit_is_never_edited", "audit_is_never_shortened"})
      raw.exec(std::string("DROP TRIGGER ") + name);
    raw.exec("UPDATE audit SET who = 'uid 7'");
    const int last = raw.execAndGet("SELECT max(id) FROM audit").getInt();
    for (int id = 1; id <= last; ++id)
      raw.exec(
          fmt::format("UPDATE audit SET hash = veneer_audit_hash(coalesce((SELECT hash FROM audit WHERE id = {}), "
                      "''), id, at, who, what, detail) WHERE id = {}",
                      id - 1, id));
    for (const std::string& trigger : triggers) raw.exec(trigger);
  }
  LoneDaemon again;
  begin(again, data);
  EXPECT_EQ(again.veneerctl({"db", "check"}).status, 0) << "nothing else is wrong with it";
  const Finished found = again.veneerctl({"db", "check", "--audit-head", then});
  EXPECT_EQ(found.status, 1);
  EXPECT_THAT(found.output, HasSubstr("has another hash"));
}

TEST_F(Records, StockIsATableForASpreadsheet) {
  const fs::path csv = directory / "stock.csv", file = directory / "stock.json";
  ASSERT_EQ(cell.veneerctl({"panel", "set", "P-0002", "--shelf", "A3", "--veneer-mm", "0.6", "--finished", "shellac",
                            "--day", "2026-04-30"})
                .status,
            0);
  ASSERT_EQ(cell.veneerctl({"export", "stock", "--out", csv.string()}).status, 0);
  const json rows = rows_of(csv);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[2]["name"], "'" + std::string(kWildName)) << "it stays a text";
  EXPECT_EQ(rows[2]["species"], "walnut; maple");
  EXPECT_EQ(rows[2]["retired_at"], "");
  EXPECT_EQ(rows[1]["shelf"], "A3");
  EXPECT_EQ(rows[1]["veneer_mm"], "0.6");
  EXPECT_EQ(rows[1]["substrate_mm"], "");
  EXPECT_EQ(rows[1]["treatments"], "finish shellac 2026-04-30");
  EXPECT_EQ(rows[0]["shelf"], "");
  EXPECT_EQ(rows[0]["mask"], "counted");
  const auto panel = cell.api().get("/panels/P-0001");
  ASSERT_TRUE(panel.ok());
  const json& book = (*panel)["area_book_mm2"];
  ASSERT_TRUE(book.is_object());
  double sum = 0;
  for (const char* part : {"free", "reserved", "cut", "kerf", "suspect", "scrap", "unusable"}) {
    const double area = std::stod(rows[0][std::string(part) + "_mm2"].get<std::string>());
    EXPECT_DOUBLE_EQ(area, book[part]) << part;
    sum += area;
  }
  EXPECT_NEAR(sum, std::stod(rows[0]["area_mm2"].get<std::string>()), 1e-6);
  EXPECT_GT(std::stod(rows[0]["reserved_mm2"].get<std::string>()), 0);

  ASSERT_EQ(cell.veneerctl({"export", "stock", "--format", "json", "--out", file.string()}).status, 0);
  const json whole = json::parse(std::ifstream(file), nullptr, false);
  EXPECT_EQ(whole["schema_version"], 1);
  ASSERT_EQ(whole["panels"].size(), 3U);
  EXPECT_EQ(whole["panels"][0]["area_book_mm2"], book);
  EXPECT_EQ(whole["panels"][2]["name"], kWildName);
}

TEST_F(Records, HistoryIsATableOfEveryPiece) {
  const fs::path csv = directory / "history.csv";
  ASSERT_EQ(cell.veneerctl({"export", "history", "--out", csv.string()}).status, 0);
  const json rows = rows_of(csv);
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[4]["mark"], "A1-5");
  EXPECT_EQ(rows[4]["panel"], "P-0002");
  EXPECT_EQ(rows[4]["state"], "reserved");
  EXPECT_EQ(rows[4]["run"], "");
  const json whole = asked({"export", "history"});
  EXPECT_EQ(whole["jobs"].size(), 1U);
  EXPECT_EQ(whole["pieces"].size(), 5U);
}

TEST_F(Records, EveryStepOfTheWoodIsARow) {
  const fs::path csv = directory / "wood.csv";
  ASSERT_EQ(cell.veneerctl({"export", "wood", "--out", csv.string()}).status, 0);
  const json rows = rows_of(csv), whole = asked({"export", "wood"});
  ASSERT_EQ(rows.size(), whole["steps"].size());
  ASSERT_GE(rows.size(), 5U);
  std::map<std::string, std::string> last;  // state, by piece
  for (const json& row : rows)
    if (const auto piece = row["piece"].get<std::string>(); !piece.empty())
      last[piece] = row["state"].get<std::string>();
  const json history = asked({"export", "history"});
  for (const json& piece : history["pieces"])
    EXPECT_EQ(last[std::to_string(piece["piece"].get<int>())], piece["state"]) << "the newest is what the piece is";
  for (std::size_t i = 1; i < whole["steps"].size(); ++i)
    EXPECT_LT(whole["steps"][i - 1]["step"], whole["steps"][i]["step"]);
}

TEST_F(Records, AllThatHappenedIsATableByTime) {
  const fs::path csv = directory / "events.csv";
  // The remnants of all three panels are booked beside all else.
  ASSERT_TRUE(cell.wait_for([this] {
    const json events = asked({"export", "events"})["events"];
    return std::count_if(events.begin(), events.end(), [](const json& row) { return row["kind"] == "remnant"; }) == 3;
  }));
  ASSERT_EQ(cell.veneerctl({"export", "events", "--out", csv.string()}).status, 0);
  const json rows = rows_of(csv), whole = asked({"export", "events"}), steps = asked({"export", "wood"});
  ASSERT_EQ(rows.size(), whole["events"].size()) << whole["events"].dump(1);
  EXPECT_EQ(std::count_if(rows.begin(), rows.end(), [](const json& row) { return row["kind"] == "wood"; }),
            static_cast<std::ptrdiff_t>(steps["steps"].size()));
  for (std::size_t i = 1; i < rows.size(); ++i) EXPECT_LE(rows[i - 1]["at"], rows[i]["at"]);
  EXPECT_TRUE(std::any_of(rows.begin(), rows.end(), [](const json& row) {
    return row["kind"] == "job" && row["job"] == "1" && row["what"] == "made";
  }));
}

TEST_F(Records, AFileThatCannotBeWrittenIsOneSentenceAndLeavesNothing) {
  const Finished refused = cell.veneerctl({"export", "stock", "--out", (directory / "nowhere" / "s.csv").string()});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.output, HasSubstr("nowhere/s.csv"));
  EXPECT_EQ(std::count(refused.output.begin(), refused.output.end(), '\n'), 1) << refused.output;
  const Finished named = cell.veneerctl({"db", "export", (directory / "cell.zip").string()});
  EXPECT_EQ(named.status, 1);
  EXPECT_THAT(named.output, HasSubstr(".tar.zst"));
}

TEST_F(Records, TheWholeCellGoesToAnotherMachineAsOneFile) {
  const fs::path file = directory / "cell.tar.zst", elsewhere = directory / "elsewhere";
  const Finished packed = cell.veneerctl({"db", "export", file.string()});
  ASSERT_EQ(packed.status, 0) << packed.output;
  EXPECT_THAT(packed.output, HasSubstr("cell.tar.zst holds all of it"));
  std::vector<json> here;
  const std::vector<std::string> questions = {"/panels", "/panels/P-0001", "/panels/P-0001/ledger",
                                              "/jobs",   "/history",       "/certificates"};
  // What is left of a panel is booked in the background, on each machine in its own time.
  const auto answer_of = [](LoneDaemon& daemon, const std::string& question) {
    json answer = *daemon.api().get(question);
    if (answer.contains("remnant")) answer["remnant"] = answer["remnant"]["woods"];
    return answer;
  };
  for (const auto& question : questions) here.push_back(answer_of(cell, question));
  cell.end();

  std::ofstream(directory / "there.toml") << "[store]\ndata_dir = \"" << elsewhere.string() << "\"\n";
  const Finished imported =
      run_program({(programs() / "veneerd").string(), "--config", (directory / "there.toml").string(), "--import",
                   file.string(), "--nothing-cut-since"});
  ASSERT_EQ(imported.status, 0) << imported.output;
  EXPECT_THAT(imported.output, HasSubstr("3 panels, 1 jobs, 5 pieces"));
  EXPECT_THAT(imported.output, HasSubstr("panels count as seen"));
  LoneDaemon there;
  begin(there, elsewhere);
  for (std::size_t i = 0; i < questions.size(); ++i) EXPECT_EQ(answer_of(there, questions[i]), here[i]) << questions[i];
  EXPECT_EQ(there.veneerctl({"db", "check"}).status, 0);
  const json audit = *there.api().get("/audit");
  std::vector<std::string> told;
  for (const json& row : audit["entries"]) told.push_back(row["what"]);
  EXPECT_THAT(told, Contains("store.restore"));
}

}  // namespace
}  // namespace veneer::tests
