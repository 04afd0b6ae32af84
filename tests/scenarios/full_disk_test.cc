// The disk fills up under a running daemon: what cannot be kept is refused in one sentence, what was kept stays, and
// the machine does what it is told.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/support/laser_only_cell.h"
#include "tests/support/own_disk.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

fs::path bin_dir() { return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin"; }

class FullDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    auto started = LaserOnlyCell::start(bin_dir());
    ASSERT_TRUE(started.ok()) << started.error().message;
    cell = std::move(*started);
  }
  Finished set_recipe(const std::string& wood) const {
    return cell->veneerctl({"recipe", "set", wood, "cut", "--speed-mm-s", "12", "--power", "80%", "--kerf-back-mm",
                            "0.31", "--kerf-show-mm", "0.22"});
  }
  std::string recipes() const { return cell->veneerctl({"recipe", "list"}).output; }

  std::unique_ptr<LaserOnlyCell> cell;
};

TEST_F(FullDisk, ARecipeIsRefusedInOneSentenceAndTheOthersStay) {
  ASSERT_EQ(set_recipe("walnut").status, 0);
  cell->set_disk_full(true);
  const Finished refused = set_recipe("maple");
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.output, HasSubstr("make room on the disk"));
  EXPECT_EQ(std::count(refused.output.begin(), refused.output.end(), '\n'), 1) << refused.output;
  EXPECT_THAT(recipes(), HasSubstr("walnut"));
  EXPECT_THAT(recipes(), Not(HasSubstr("maple")));

  cell->set_disk_full(false);
  EXPECT_EQ(set_recipe("maple").status, 0);
  EXPECT_THAT(recipes(), HasSubstr("walnut"));
  EXPECT_THAT(recipes(), HasSubstr("maple"));
}

TEST_F(FullDisk, APatternUnderWayIsBurntToItsEndAndTheCellGoesOn) {
  ASSERT_TRUE(cell->begin_pattern(20).ok());
  ASSERT_TRUE(cell->wait_for([&] { return cell->laser.beam_on(); }));
  cell->set_disk_full(true);
  EXPECT_TRUE(cell->wait_for([&] { return cell->state() == "Complete"; })) << cell->state();
  EXPECT_NEAR(cell->laser.burnt_mm(), 80 + 2 * 28.28 + 50.2 + 2 * (2 + 4 + 2) + 16, 1.0);
  EXPECT_FALSE(cell->laser.beam_on());

  cell->set_disk_full(false);
  const Finished burnt = cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"});
  EXPECT_EQ(burnt.status, 0) << burnt.output;
}

TEST_F(FullDisk, StopStopsAndItsClearIsHeard) {
  ASSERT_TRUE(cell->begin_pattern(300).ok());
  ASSERT_TRUE(cell->wait_for([&] { return cell->laser.beam_on(); }));
  cell->set_disk_full(true);
  const std::size_t before = cell->laser.resets().size();
  EXPECT_EQ(cell->veneerctl({"stop"}).status, 0);
  EXPECT_TRUE(cell->wait_for([&] { return cell->laser.resets().size() > before; })) << "the byte is on its way";
  EXPECT_TRUE(cell->wait_for([&] { return cell->state() == "Aborted"; })) << cell->state();
  EXPECT_FALSE(cell->laser.beam_on());
  cell->set_disk_full(false);
  EXPECT_TRUE(cell->api().post("/commands/clear").ok());
  EXPECT_EQ(cell->state(), "Stopped");
}

// The refusal comes before the job is looked for, so that none is needed here.
TEST(SmallDisk, StartsNoJobUntilThereIsRoom) {
  const testing::TempDirectory folder(testing::TempDirectory::Place::kDisk);
  const auto told = testing::OwnDisk::run(folder.path(), 64'000'000, [&](const testing::OwnDisk& disk) -> std::string {
    LoneDaemonOptions options;
    options.data = folder.path() / "data";
    fs::create_directory(options.data);
    auto cell = LaserOnlyCell::start(bin_dir(), LaserOnlyCell::quick_laser(), options);
    if (!cell) return cell.error().message;
    if (const auto reset = (*cell)->api().post("/commands/reset"); !reset) return reset.error().message;
    const auto start = [&] {
      const auto started = (*cell)->api().post("/jobs/1/start");
      return started ? "started" : started.error().message;
    };
    const auto is_full = [&] { return start().find("the disk is nearly full") != std::string::npos; };
    if (is_full()) return "refused on an empty disk";
    disk.fill_but(5'000'000);
    // It asks the disk each minute, and at its own start.
    if (const Status again = (*cell)->kill_and_start_again(); !again) return again.error().message;
    if (const Status checked = (*cell)->wait_until_checked(); !checked) return checked.error().message;
    if (const auto reset = (*cell)->api().post("/commands/reset"); !reset) return reset.error().message;
    if (!(*cell)->wait_for(is_full)) return "on a full disk: " + start();
    disk.empty();
    if (!(*cell)->wait_for([&] { return !is_full(); })) return "with room again: " + start();
    return "";
  });
  VENEER_REQUIRE_DISK(told);
  EXPECT_EQ(*told, "");
}

}  // namespace
}  // namespace veneer::tests
