// A prepared cell with an operator before it who has a browser: Debian's chromium, driven over WebDriver by a script of
// this folder. What hands do at the machine the scripts do with `veneerctl sim`.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "base/files.h"
#include "tests/scenarios/operated_cell.h"

namespace veneer::tests {

class Console : public OperatedCell {
 protected:
  // Slow enough that Hold is pressed while something is left to cut.
  double time_scale() const override { return 6; }
  SimulatedCellOptions options() const override {
    SimulatedCellOptions out = OperatedCell::options();
    out.daemon_tables = "[before_motion]\nconfirm = [\"exhaust\", \"air assist\"]\n";
    return out;
  }
  // In the browser, by one of the scripts beside this file. Its pictures outlive a failure, so that it is seen what the
  // operator saw.
  void play(const char* script) {
    std::ofstream(dir_ / "second.png", std::ios::binary) << target();
    const std::filesystem::path pictures = VENEER_PAGES;
    std::filesystem::create_directories(pictures);
    const auto program = std::filesystem::path(VENEER_CONSOLE_DAY).replace_filename(script);
    const std::string operators = link();  // the first one
    auto day =
        ChildProcess::start({"/usr/bin/python3", program.string(), operators, pictures.string()}, dir_ / "day.log",
                            {{"VENEERCTL", (bin_dir() / "veneerctl").string()},
                             {"MAINTAINER_LINK", link("maintainer")},
                             {"VENEERD_SOCKET", cell_->api_socket().string()},
                             {"VENEER_TWIN_SOCKET", cell_->twin_socket().string()},
                             {"PICTURE", (dir_ / "second.png").string()}});
    ASSERT_TRUE(day.ok()) << day.error().message;
    EXPECT_EQ(day->wait(), 0) << read_whole(dir_ / "day.log").value_or("no log");
  }
  std::string link(const char* role = "operator") const {
    const auto made = cell_->api().post("/console-links", {{"role", role}});
    return made ? (*made)["url"].get<std::string>() : made.error().message;
  }
};

}  // namespace veneer::tests
