#include "cli/colours.h"

#include <gtest/gtest.h>

namespace veneer::cli {
namespace {

TEST(Colours, OnATerminalOfSomebodyWhoHasNotRefusedThem) {
  EXPECT_TRUE(wants_colours(true, nullptr, "xterm-256color"));
  EXPECT_TRUE(wants_colours(true, "", "xterm")) << "an empty NO_COLOR says nothing";
  EXPECT_FALSE(wants_colours(true, "1", "xterm"));
  EXPECT_FALSE(wants_colours(false, nullptr, "xterm")) << "a file or a pipe";
  EXPECT_FALSE(wants_colours(true, nullptr, "dumb"));
  EXPECT_FALSE(wants_colours(true, nullptr, nullptr));
}

TEST(Colours, AreOfStatesAndOfWhatIsAmissAndLeaveTheWordsAsTheyAre) {
  const std::string red = "\x1b[1;31m", yellow = "\x1b[1;33m", bold = "\x1b[1m", plain = "\x1b[0m";
  EXPECT_EQ(with_colours("Idle\n  Ready.\n"), "Idle\n  Ready.\n");
  EXPECT_EQ(with_colours("Aborted: STOP by anna.\n"), red + "Aborted" + plain + ": STOP by anna.\n");
  EXPECT_EQ(with_colours("Suspect      2: look\nNext         Clear\n"),
            yellow + "Suspect" + plain + "      2: look\n" + bold + "Next" + plain + "         Clear\n");
  EXPECT_EQ(with_colours("A1-1   suspect   P-0001\n"), "A1-1   " + yellow + "suspect" + plain + "   P-0001\n");
  EXPECT_EQ(with_colours("the cell was Held, and unsuspected\n"), "the cell was Held, and unsuspected\n")
      << "a word in a sentence";
}

}  // namespace
}  // namespace veneer::cli
