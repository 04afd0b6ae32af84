// A cell at work is backed up, and the backup becomes a cell elsewhere and takes the place of a damaged database.
#include <gmock/gmock.h>

#include <fstream>
#include <map>

#include "base/files.h"
#include "tests/scenarios/operated_cell.h"
#include "tests/support/lone_daemon.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

class BackedUp : public OperatedCell {
 protected:
  // Slow enough that pieces are left to cut while it is backed up.
  double time_scale() const override { return 4; }
  Finished veneerctl(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {(bin_dir() / "veneerctl").string(), "--socket", cell_->api_socket().string()});
    return run_program(arguments);
  }
  static Finished restore(const fs::path& config, const std::string& backup) {
    return run_program({(bin_dir() / "veneerd").string(), "--config", config.string(), "--restore", backup});
  }
  std::string newest_backup() const { return get("/backups")["backups"].at(0)["folder"]; }
  // What a person would compare.
  static std::vector<json> stock(const cli::ApiClient& api) {
    std::vector<json> out;
    for (const std::string& target :
         {std::string("/panels"), fmt::format("/panels/{}/ledger", kPanel), fmt::format("/jobs/{}/pieces", kJob)}) {
      auto reply = api.get(target);
      EXPECT_TRUE(reply.ok()) << target;
      out.push_back(reply ? *reply : json());
    }
    return out;
  }
  // As `stock`, but for what a backup that was put back adds: that each panel waits for a scan.
  static std::vector<json> restored_stock(const cli::ApiClient& api) {
    auto out = stock(api);
    for (json& panel : out.front()["panels"]) {
      EXPECT_THAT(panel.value("scan_again", ""), HasSubstr("was put back")) << panel["id"];
      panel.erase("scan_again");
    }
    return out;
  }
  // "kerf" -> "valid"
  static std::map<std::string, std::string> certificates(const cli::ApiClient& api) {
    std::map<std::string, std::string> out;
    const auto reply = api.get("/certificates");
    EXPECT_TRUE(reply.ok());
    if (reply)
      for (const json& certificate : (*reply)["certificates"]) out[certificate["kind"]] = certificate["state"];
    return out;
  }
};

TEST_F(BackedUp, WhileItCutsAndBecomesACellOnAnotherMachine) {
  cut_some();
  // However slow a machine makes the backup, pieces are left to cut.
  ASSERT_EQ(post("/commands/hold"), "");
  wait_state("Held");
  const Finished made = veneerctl({"db", "backup"});
  ASSERT_EQ(made.status, 0) << made.output;
  EXPECT_THAT(made.output, HasSubstr("was made and checked"));
  ASSERT_EQ(post("/commands/unhold"), "");
  wait_state("Complete");
  const std::string backup = newest_backup();
  EXPECT_THAT(veneerctl({"db", "backups"}).output, HasSubstr(backup));

  // What is cut now is booked on both sides of the backup.
  const auto now = stock(cell_->api());
  lift();
  const Finished after = veneerctl({"db", "backup"});
  ASSERT_EQ(after.status, 0) << after.output;
  const std::string newer = newest_backup();
  ASSERT_NE(newer, backup);

  testing::TempDirectory elsewhere(testing::TempDirectory::Place::kDisk);
  for (const auto& [folder, name] : {std::pair(backup, "during"), std::pair(newer, "after")}) {
    const fs::path data = elsewhere / name, config = elsewhere / (std::string(name) + ".toml");
    std::ofstream(config) << "[store]\ndata_dir = \"" << data.string() << "\"\n";
    const Finished restored = restore(config, folder);
    ASSERT_EQ(restored.status, 0) << restored.output;
    EXPECT_THAT(restored.output, HasSubstr("is in place in " + data.string()));
    EXPECT_THAT(restored.output, HasSubstr("Which devices the cell has is in no backup. Here they are: laser: "));
    LoneDaemon there;
    LoneDaemonOptions options;
    options.data = data;
    ASSERT_TRUE(
        there.start(bin_dir(), "kind = \"lihuiyu\"\nport = \"file:" + (data / "wire").string() + "\"\n", options).ok());
    // A restored file was not closed by anybody: it is checked whole, and what was being cut is recovered.
    ASSERT_TRUE(there.wait_for([&] {
      const auto status = there.api().get("/status");
      return status && (*status)["database"]["state"] == "good";
    }));
    const Finished checked = there.veneerctl({"db", "check"});
    EXPECT_EQ(checked.status, 0) << checked.output;
    const auto map = there.api().get_bytes(fmt::format("/panels/{}/map.png", kPanel));
    EXPECT_TRUE(map.ok()) << map.error().message;
    if (folder == newer) {
      EXPECT_EQ(restored_stock(there.api()), now);
      // What was measured with another laser does not count for this one.
      const std::map<std::string, std::string> not_of_this_laser = {
          {"axes", "other_device"}, {"camera", "valid"}, {"kerf", "other_device"}, {"scanner", "valid"}};
      EXPECT_EQ(certificates(there.api()), not_of_this_laser);
      continue;
    }
    // In the midst of a run: the pieces that were cut by then are cut, at most one is suspect, and none is lost.
    int cut = 0, suspect = 0;
    const auto pieces = there.api().get(fmt::format("/jobs/{}/pieces", kJob));
    ASSERT_TRUE(pieces.ok());
    for (const auto& piece : (*pieces)["pieces"]) {
      cut += piece["state"] == "cut" ? 1 : 0;
      suspect += piece["state"] == "suspect" ? 1 : 0;
    }
    EXPECT_EQ((*pieces)["pieces"].size(), 16U);
    EXPECT_GE(cut, 3);
    EXPECT_LT(cut, 16);
    EXPECT_LE(suspect, 1);
  }
}

TEST_F(BackedUp, AndADamagedDatabaseIsReplacedAndTheCellGoesOn) {
  ASSERT_EQ(veneerctl({"db", "backup"}).status, 0);
  const std::string backup = newest_backup();
  const auto before = stock(cell_->api());
  const auto certified = certificates(cell_->api());
  const Finished refused = restore(cell_->config_file(), backup);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.output, HasSubstr("another veneerd is running; stop it first"));
  cell_->kill_daemon();
  {
    // A row that counts, as a dying disk loses it.
    std::fstream raw(cell_->database_file(), std::ios::in | std::ios::out | std::ios::binary);
    const std::string bytes = read_whole(cell_->database_file()).value_or("");
    const auto row = bytes.find("A2-3");
    ASSERT_NE(row, std::string::npos);
    raw.clear();
    raw.seekp(static_cast<std::streamoff>(row));
    raw << 'x';
  }
  ASSERT_TRUE(cell_->start_daemon().ok());
  const json damaged = wait([](const json& s) { return s["database"]["state"] == "damaged"; });
  EXPECT_THAT(damaged["database"].value("sentence", ""), HasSubstr("--restore"));
  cell_->stop_daemon();
  const Finished restored = restore(cell_->config_file(), backup);
  ASSERT_EQ(restored.status, 0) << restored.output;
  EXPECT_THAT(restored.output, HasSubstr("What was there before is kept in"));
  ASSERT_TRUE(cell_->start_daemon().ok());
  wait([](const json& s) { return s["database"]["state"] == "good"; });
  EXPECT_EQ(restored_stock(cell_->api()), before);
  EXPECT_EQ(certificates(cell_->api()), certified);
  // Whether work was broken off, nobody could read: somebody has to have looked.
  EXPECT_EQ(get("/status")["state"], "Aborted");
  EXPECT_EQ(post("/commands/clear"), "");
  // What was cut since the backup is in no row: nothing begins before the panel was looked at.
  EXPECT_EQ(post("/commands/reset"), "");
  EXPECT_THAT(post(fmt::format("/jobs/{}/start", kJob)), HasSubstr("scan it, so that what was cut from it meanwhile"));
  ASSERT_TRUE(story_->reconcile(kJob).ok());
  cut_and_prove();
  EXPECT_EQ(get(fmt::format("/jobs/{}", kJob))["state"], "complete");
}

}  // namespace
}  // namespace veneer::tests
