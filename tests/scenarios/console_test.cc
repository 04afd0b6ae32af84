// An operator's short day in the browser: Debian's chromium, driven by console_day.py over WebDriver, on the simulated
// cell. What hands do at the machine the script does with `veneerctl sim`.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "tests/scenarios/operated_cell.h"

namespace veneer::tests {
namespace {

class Console : public OperatedCell {
 protected:
  // Slow enough that Hold is pressed while something is left to cut.
  double time_scale() const override { return 6; }
  SimulatedCellOptions options() const override {
    SimulatedCellOptions out = OperatedCell::options();
    out.daemon_tables = "[before_motion]\nconfirm = [\"exhaust\", \"air assist\"]\n";
    return out;
  }
  std::string link() const {
    const auto made = cell_->api().post("/console-links");
    return made ? (*made)["url"].get<std::string>() : made.error().message;
  }
};

TEST_F(Console, AnOperatorsShortDay) {
  std::ofstream(dir_ / "second.png", std::ios::binary) << target();
  // Outlives a failure, so that it is seen what the operator saw.
  const std::filesystem::path pictures = VENEER_PAGES;
  std::filesystem::create_directories(pictures);
  auto day = ChildProcess::start({"/usr/bin/python3", VENEER_CONSOLE_DAY, link(), pictures.string()}, dir_ / "day.log",
                                 {{"VENEERCTL", (bin_dir() / "veneerctl").string()},
                                  {"VENEERD_SOCKET", cell_->api_socket().string()},
                                  {"VENEER_TWIN_SOCKET", cell_->twin_socket().string()},
                                  {"PICTURE", (dir_ / "second.png").string()}});
  ASSERT_TRUE(day.ok()) << day.error().message;
  const int status = day->wait();
  std::ifstream log(dir_ / "day.log");
  EXPECT_EQ(status, 0) << std::string(std::istreambuf_iterator<char>(log), {});
  // STOP was the last of it.
  EXPECT_EQ(get("/status")["state"], "Aborted");
  const nlohmann::json second = get("/jobs/2");
  EXPECT_EQ(second["cut"], second["pieces"]) << "what the page made and cut is in the ledger";
}

}  // namespace
}  // namespace veneer::tests
