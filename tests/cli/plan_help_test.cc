// The table of options in docs/PLANNER.md says what the commands' --help say.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>

namespace veneer::planner {
namespace {

// "--name" with nothing of a name before or behind it.
std::set<std::string> options_in(const std::string& text) {
  constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyz-";
  std::set<std::string> out;
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_not_of(kLetters, at), text.size());
    if (end > at + 2) out.insert(text.substr(at, end - at));
    at = end;
  }
  return out;
}

// Those that begin a line.
std::set<std::string> options_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen((VENEERCTL " " + command + " --help").c_str(), "r"),
                                                   ::pclose);
  std::set<std::string> out;
  std::array<char, 4096> line{};
  while (::fgets(line.data(), line.size(), pipe.get()) != nullptr) {
    const std::string text = line.data();
    if (text.rfind("  --", 0) == 0) out.merge(options_in(text.substr(0, text.find_first_of(" \n", 2))));
  }
  return out;
}

TEST(PlanHelp, EveryOptionIsInTheTable) {
  std::ifstream file(VENEER_SOURCE "/docs/PLANNER.md");
  std::set<std::string> named, starred;
  bool there = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("## ", 0) == 0) there = line == "## Options of `veneerctl plan`";
    if (!there || line.rfind("| `--", 0) != 0) continue;
    const std::string cell = line.substr(0, line.find('|', 1));
    const std::set<std::string> options = options_in(cell);
    named.insert(options.begin(), options.end());
    if (cell.find(" * ") != std::string::npos) starred.insert(options.begin(), options.end());
  }
  const std::set<std::string> of_plan = options_of("plan"), of_job = options_of("job new");
  ASSERT_GT(of_plan.size(), 40U);
  EXPECT_EQ(named, of_plan);
  std::set<std::string> of_both;
  for (const std::string& option : of_plan)
    if (of_job.count(option) == 1) of_both.insert(option);
  EXPECT_EQ(starred, of_both);
}

}  // namespace
}  // namespace veneer::planner
