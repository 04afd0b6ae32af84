// README.md's way to the first cut piece, and docs/DAY.md's day after it, played as they stand there: nothing is put in
// but what a newcomer has (the repository's folder, and `./dev build`, which is done).
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

struct Played {
  std::string commands;               // between ```
  std::vector<std::string> promised;  // lines between ```console: what it shows
};

std::string section_of(const std::string& readme, const std::string& heading) {
  const std::size_t begin = readme.find("\n" + heading + "\n"), end = readme.find("\n### ", begin + 1);
  EXPECT_NE(begin, std::string::npos) << heading;
  return readme.substr(begin, end - begin);
}

Played played_from(const std::string& written) {
  std::istringstream text(written);
  Played section;
  enum { kProse, kCommands, kPromised } now = kProse;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("```"))
      now = now != kProse ? kProse : line == "```console" ? kPromised : kCommands;
    else if (now == kCommands)
      section.commands += line + "\n";
    else if (now == kPromised)
      section.promised.push_back(line);
  }
  return section;
}

TEST(ByHand, TheReadmeLeadsToTheFirstCutPieceAndADayGoesOnFromThere) {
  const fs::path source = VENEER_SOURCE;
  // On a disk: maps and databases are large. Its name is short, since names of sockets are limited to 107 bytes.
  const testing::TempDirectory folder(testing::TempDirectory::Place::kDisk);
  // `./dev build` has been done.
  std::ofstream(folder / "dev") << "#!/bin/sh\n[ \"$*\" = build ]\n";
  fs::permissions(folder / "dev", fs::perms::owner_all);
  fs::create_directories(folder / "build");
  fs::create_directory_symlink(fs::path(VENEERD).parent_path(), folder / "build/bin");
  fs::create_directory_symlink(source / "docs", folder / "docs");
  fs::create_directories(folder / "systemd");
  fs::copy_file(source / "systemd/veneer-twin.toml", folder / "systemd/veneer-twin.toml");
  // Port 8765 is one for the whole machine, where other tests run.
  const std::string shipped = text_of(source / "systemd/veneerd.toml");
  ASSERT_THAT(shipped, HasSubstr("\nlisten = \"127.0.0.1:8765\""));
  std::ofstream(folder / "systemd/veneerd.toml")
      << std::regex_replace(shipped, std::regex("listen = \"127.0.0.1:8765\""), "listen = \"\"");

  const Played first = played_from(section_of(text_of(source / "README.md"), "### To the first cut piece"));
  const Played day = played_from(text_of(source / "docs/DAY.md"));
  // The first line that fails ends it, and so do the two programs that it left running.
  std::ofstream(folder / "played.sh") << "set -e\ntrap 'kill $(jobs -p)' EXIT\ncd '" << folder.path().string() << "'\n"
                                      << "PS4='+ '; set -x\n"
                                      << first.commands << day.commands;
  const Finished played =
      run_program({"/usr/bin/timeout", "--kill-after=10", "1200", "/bin/bash", (folder / "played.sh").string()});
  EXPECT_EQ(played.status, 0) << played.output;
  EXPECT_GE(first.promised.size(), 5U);
  EXPECT_GE(day.promised.size(), 9U);
  for (const Played& part : {first, day})
    for (const std::string& line : part.promised) EXPECT_THAT(played.output, HasSubstr(line));
  const Finished read = run_program({"/usr/bin/gs", "-q", "-dBATCH", "-dNOPAUSE", "-dSAFER", "-sDEVICE=txtwrite",
                                     "-sOutputFile=" + (folder / "map.txt").string(), (folder / "map.pdf").string()});
  EXPECT_EQ(read.status, 0) << read.output;
  EXPECT_THAT(text_of(folder / "map.txt"), HasSubstr("Panel P-0001, as cut"));
}

}  // namespace
}  // namespace veneer::tests
