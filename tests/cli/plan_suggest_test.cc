// `veneerctl plan --suggest` and `--crop`, as a user runs them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

struct CommandEnd {
  int status = -1;
  std::string errors;
};

class PlanSuggest : public ::testing::Test {
 protected:
  PlanSuggest() {
    cv::imwrite(path("panel.png"), test::wood_panel("P", 150, 120, 50.8, 3).picture.pixels);
    cv::imwrite(path("target.png"), test::blob_artwork("A", 60, 40, 20_mm, 4).picture);
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string text(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    std::ostringstream out;
    out << file.rdbuf();
    return out.str();
  }
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(text(name)); }
  CommandEnd run(const std::string& arguments) const {
    const std::string command =
        std::string(VENEERCTL) + " " + arguments + " 2>" + path("stderr") + " >" + path("stdout");
    const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe): a test has one thread here
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text("stderr")};
  }
  CommandEnd plan(const std::string& arguments) const { return run("plan " + arguments); }
  std::string usual(const std::string& target = "target.png") const {
    return "--target " + path(target) + " --panel " + path("panel.png") +
           ",dpi=50.8,id=P --size-mm 21 --patch-mm 7 --dpi 50.8 --rotations 5 --out " + path("out");
  }
  void expect_unusable(const std::string& arguments, const std::string& sentence) const {
    const CommandEnd outcome = plan(arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_THAT(outcome.errors, HasSubstr(sentence)) << arguments;
  }

 private:
  veneer::testing::TempDirectory folder_;
};

TEST_F(PlanSuggest, PlansAPartOfThePicture) {
  ASSERT_EQ(plan(usual() + " --crop 20,0,40,40").status, 0);
  const auto artwork = json("out/plan.json")["artworks"][0];
  EXPECT_EQ(artwork["width_mm"], 21);
  EXPECT_EQ(artwork["height_mm"], 21);
  // The same as of a file that has only this part.
  const std::string cropped = json("out/plan.json")["pieces"].dump();
  cv::imwrite(path("part.png"), cv::imread(path("target.png"))(cv::Rect(20, 0, 40, 40)));
  ASSERT_EQ(plan(usual("part.png")).status, 0);
  EXPECT_EQ(json("out/plan.json")["pieces"].dump(), cropped);
  expect_unusable(usual() + " --crop 30,0,40,40", "does not lie within");
  expect_unusable(usual() + " --crop 30,0,40", "is not X,Y,WIDTH,HEIGHT in whole pixels");
  expect_unusable(usual() + " --crop 1,1,9,9 --crop 1,1,9,9", "more --crop than --target");
}

TEST_F(PlanSuggest, SuggestsAndEachSuggestionIsACommand) {
  const CommandEnd outcome = plan(usual() + " --priority center --w-hist 1 --suggest");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_FALSE(fs::exists(path("out/plan.json")));
  const cv::Mat sheet = cv::imread(path("out/suggestions.png"));
  EXPECT_GT(sheet.rows, 300);
  const auto advice = json("out/suggestions.json");
  EXPECT_EQ(advice["schema_version"], 1);
  const auto& list = advice["suggestions"];
  ASSERT_GE(list.size(), 2U);
  ASSERT_TRUE(advice["suggested"].is_number());
  for (const auto& it : list) {
    EXPECT_TRUE(fs::exists(path("out/" + it["preview"].get<std::string>())));
    EXPECT_THAT(text("stdout"), HasSubstr(it["command"].get<std::string>()));
  }
  // The last one, of the closest crop, as it stands there.
  const auto& last = list.back();
  std::string command = last["command"];
  EXPECT_THAT(command, HasSubstr(" --crop "));
  EXPECT_THAT(command, HasSubstr(" --w-hist 1 "));
  EXPECT_THAT(command, Not(HasSubstr("--suggest")));
  ASSERT_EQ(command.rfind("veneerctl ", 0), 0U);
  command = command.substr(10, command.find(" --out ") - 10) + " --out " + path("planned");
  const CommandEnd planned = run(command);
  ASSERT_EQ(planned.status, 0) << planned.errors;
  const auto report = json("planned/report.json");
  EXPECT_EQ(report["unfilled"], 0);
  EXPECT_EQ(report["pieces"], last["pieces"]);
}

TEST_F(PlanSuggest, SuggestsForOnePicture) {
  expect_unusable(usual() + " --suggest --target " + path("target.png"), "give one --target");
  expect_unusable(usual() + " --suggest --layout segmentation", "leave --layout segmentation out");
  expect_unusable(usual() + " --suggest --repeat 2", "no --repeat");
  expect_unusable(usual() + " --suggest --best-so-far", "leave --best-so-far out");
  expect_unusable(usual() + " --suggest --keep plan.json", "leave --keep out");
  expect_unusable(usual() + " --suggest --forbid Q,0,0,9,9", "Q");
}

}  // namespace
}  // namespace veneer::planner
