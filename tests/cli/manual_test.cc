// Man pages and completion, of the commands that there are.
#include "cli/manual.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>
#include <string>

#include "cli/command_tree.h"
#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Manual : public ::testing::Test {
 protected:
  Manual() {
    add_common_options(app_, context_, "1");
    add_cell_tree(app_, context_);
  }
  // What bash offers for the last of these words.
  std::string offered(const std::string& words) const {
    const testing::TempDirectory folder;
    std::ofstream(folder / "completion") << bash_completion(app_);
    std::ofstream(folder / "ask") << "set -e\nsource '" << (folder / "completion").string() << "'\nCOMP_WORDS=("
                                  << words
                                  << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_veneerctl\necho \"${COMPREPLY[@]}\"\n";
    const auto answer = tests::run_program({"/bin/bash", (folder / "ask").string()});
    EXPECT_EQ(answer.status, 0) << answer.output;
    return answer.output;
  }

  CLI::App app_{"Runs a cell", "veneerctl"};
  CommandContext context_;
};

TEST_F(Manual, APageSaysWhatHelpSays) {
  const std::string page = man_page(*app_.get_subcommand("sim"), "veneerctl-sim", false);
  EXPECT_THAT(page, HasSubstr(".TH VENEERCTL\\-SIM 1"));
  EXPECT_THAT(page, HasSubstr(".SS veneerctl sim new\\-board\n"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-width\\-mm\\fR"));
  EXPECT_THAT(page, HasSubstr("Without it: 490."));
  EXPECT_THAT(page, HasSubstr("\\fBVENEER_TWIN_SOCKET\\fR"));
  EXPECT_THAT(man_page(*app_.get_subcommand("stop-after-piece"), "veneerctl-stop-after-piece", false),
              HasSubstr("\\fBveneerctl stop\\-after\\-piece\\fR"));
  EXPECT_THAT(page, Not(HasSubstr("\\fI\\fR"))) << "a flag takes nothing";
  const std::string laser = man_page(*app_.get_subcommand("laser"), "veneerctl-laser", false);
  const auto from = laser.find(".SS veneerctl laser run\n");
  ASSERT_NE(from, std::string::npos);
  const std::string run = laser.substr(from, laser.find("\n.SS ", from) - from);
  EXPECT_THAT(run, HasSubstr("Not with a Lihuiyu board: there, \\-\\-dry")) << "what to do instead";
  const std::string whole = man_page(app_, "veneerctl", true);
  EXPECT_THAT(whole, HasSubstr("\\fBveneerctl\\-job\\fR(1)"));
  EXPECT_THAT(whole, HasSubstr("is no emergency stop"));
  // A line that begins with a point or an apostrophe would be an order to roff.
  std::istringstream lines(page + whole);
  for (std::string line; std::getline(lines, line);)
    if (!line.empty() && (line[0] == '.' || line[0] == '\'')) {
      const bool meant = line.starts_with(".\\\"") || line.starts_with(".TH ") || line.starts_with(".SH ") ||
                         line.starts_with(".SS ") || line == ".TP" || line == ".PP";
      EXPECT_TRUE(meant) << line;
    }
}

TEST_F(Manual, BashCompletesCommandsOptionsAndTheirWords) {
  EXPECT_THAT(offered("veneerctl sta"), HasSubstr("status"));
  EXPECT_THAT(offered("veneerctl job st"), HasSubstr("start"));
  EXPECT_THAT(offered("veneerctl job st"), HasSubstr("stop"));
  EXPECT_THAT(offered("veneerctl job st"), Not(HasSubstr("status")));
  EXPECT_EQ(offered("veneerctl job map 1 --vi"), "--view\n");
  EXPECT_EQ(offered("veneerctl job map 1 --view b"), "back\n");
  EXPECT_EQ(offered("veneerctl --socket somewhere sim place grid --face s"), "show\n") << "options before commands";
  EXPECT_EQ(offered("veneerctl --socket /et"), "/etc\n") << "a file where no words are fixed";
}

}  // namespace
}  // namespace veneer::cli
