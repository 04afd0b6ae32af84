// The first day in the browser: Debian's chromium, driven by setup_day.py over WebDriver, on a simulated cell that
// nobody has set up. What hands do at the machine the script does with `veneerctl sim`.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "base/files.h"
#include "tests/support/child_process.h"
#include "tests/support/sane_config.h"
#include "tests/support/simulated_cell.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {
namespace {

// Nothing prepared: what the page makes of an unpacked machine. The twin's pictures are as coarse as the certificates'
// limits allow, since making them is most of what this costs.
TEST(FirstDay, FromTheUnpackedMachineToTheFirstCutPiece) {
  const testing::TempDirectory dir(testing::TempDirectory::Place::kDisk);
  SimulatedCellOptions options{
      dir / "cell", std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin", 3, 40};
  options.twin_tables = "sheet_dpi = 200\n";
  options.daemon_tables = "[devices]\nchoose = true\n";
  // Its own backends, not whatever scanners the house has.
  testing::write_sane_config(dir / "sane");
  options.scanner = "kind = \"sim\"\nsane_config_dir = \"" + (dir / "sane").string() + "\"\n";
  auto cell = SimulatedCell::start(options);
  ASSERT_TRUE(cell.ok()) << cell.error().message;
  std::ofstream((*cell)->data_dir() / "camera" / "bed.jpg") << "a picture";
  const auto link = (*cell)->api().post("/console-links", {{"role", "maintainer"}});
  ASSERT_TRUE(link.ok()) << link.error().message;
  const std::filesystem::path pictures = VENEER_PAGES;
  std::filesystem::create_directories(pictures);
  auto day = ChildProcess::start(
      {"/usr/bin/python3", VENEER_SETUP_DAY, (*link)["url"].get<std::string>(), pictures.string()}, dir / "day.log");
  ASSERT_TRUE(day.ok()) << day.error().message;
  const int status = day->wait();
  EXPECT_EQ(status, 0) << read_whole(dir / "day.log").value_or("no log");
  const auto job = (*cell)->api().get("/jobs/1");
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_GT((*job)["cut"], 0);
  EXPECT_EQ((*job)["cut"], (*job)["pieces"]);
}

}  // namespace
}  // namespace veneer::tests
