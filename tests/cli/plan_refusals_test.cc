// What `veneerctl plan` cannot do is told in one sentence, at once, with a way out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "planner/files/plan_files.h"
#include "planner/problem/problem.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class PlanRefusals : public ::testing::Test {
 protected:
  PlanRefusals() {
    cv::imwrite(path("panel.png"), test::wood_panel("P", 150, 120, 50.8, 3).picture.pixels);
    cv::imwrite(path("target.png"), test::blob_artwork("A", 60, 40, 20_mm, 4).picture);
    cv::imwrite(path("dot.png"), cv::Mat(1, 1, CV_8UC3, cv::Scalar(9, 9, 9)));
    std::ofstream(path("text")) << "no plan";
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  // The sentence, without its "veneerctl: "; fails unless it is one, and the last word on standard error.
  std::string refused(int status, const std::string& arguments, const std::string& target = "target.png",
                      const std::string& panel = "panel.png") const {
    const std::string command = "cd " + folder_.path().string() + " && " + VENEERCTL + " plan --target '" + target +
                                "' --panel '" + panel + "' --size-mm 21 " + arguments + " >out_text 2>words";
    const int ended = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe): a test has one thread here
    EXPECT_EQ(WIFEXITED(ended) ? WEXITSTATUS(ended) : -1, status) << arguments;
    std::ifstream file(path("words"));
    std::ostringstream words;
    words << file.rdbuf();
    const std::string prefix = "veneerctl: ", text = words.str();
    const std::size_t at = text.find(prefix);
    EXPECT_NE(at, std::string::npos) << text;
    std::string sentence = at == std::string::npos ? "" : text.substr(at + prefix.size());
    EXPECT_EQ(std::count(sentence.begin(), sentence.end(), '\n'), 1) << text;
    return sentence;
  }

 private:
  veneer::testing::TempDirectory folder_;
};

TEST_F(PlanRefusals, NumbersAreCheckedBeforeAnyPictureIsRead) {
  const auto refused_early = [this](const std::string& option) {
    return refused(2, option + " --out out", "no_such_target.png", "no_such_panel.png");
  };
  EXPECT_THAT(refused_early("--w-edge nan"), HasSubstr("the edge weight must lie between 0 and 1"));
  EXPECT_THAT(refused_early("--dpi 0"), HasSubstr("the working resolution must lie between 10 and 2400 dpi"));
  EXPECT_THAT(refused_early("--kerf-mm -1"), HasSubstr("the kerf must lie between 0 and 10 mm"));
  EXPECT_THAT(refused_early("--patch-mm nan"), HasSubstr("the patch size must lie between 0.1 and 10000 mm"));
  EXPECT_THAT(refused_early("--threads -1"), HasSubstr("the number of threads must not be negative"));
  EXPECT_THAT(refused_early("--w-hist 2"), HasSubstr("the histogram weight"));
}

TEST_F(PlanRefusals, EveryPartOfAPanelIsNamed) {
  const auto refused_panel = [this](const std::string& panel) { return refused(2, "--out out", "target.png", panel); };
  EXPECT_THAT(refused_panel(""), HasSubstr("--panel \"\" names no picture"));
  for (const std::string key : {"mask", "dpi", "id", "material", "species"})
    EXPECT_THAT(refused_panel("panel.png," + key + "="), HasSubstr("names no " + key + ": leave \""));
  EXPECT_THAT(refused_panel("panel.png,colour=red"), HasSubstr("holds \"colour=\", but only mask=, dpi=, id= and"));
  EXPECT_THAT(refused_panel("panel.png,id=a/b"), HasSubstr("give another with id=NAME"));
  EXPECT_THAT(refused_panel("dot.png"), HasSubstr("the picture of panel dot has only 1 x 1 pixels: choose another"));
  // A comma and an equals sign may be a file's own.
  fs::copy_file(path("panel.png"), path("a,b=c.png"));
  EXPECT_THAT(refused_panel("a,b=c.png,id=a/b"), HasSubstr("\"a/b\" cannot be the id"));
}

TEST_F(PlanRefusals, FilesAreNamed) {
  EXPECT_EQ(refused(2, "--out out", ""), "--target \"\" names no picture\n");
  EXPECT_EQ(refused(2, "--out ''"), "--out \"\" names no directory\n");
  EXPECT_EQ(refused(2, "--keep text --out out"), "text: the plan is not a JSON object\n");
}

TEST_F(PlanRefusals, CountsBelowNothingAreRefused) {
  for (const std::string name : {"seed", "alternatives", "optimize_iterations"}) {
    std::string option = "--" + name;
    std::replace(option.begin(), option.end(), '_', '-');
    const std::string command = "cd " + path("") + " && " + VENEERCTL + " plan --target target.png --panel panel.png " +
                                option + " -1 --out out 2>words";
    EXPECT_NE(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe): a test has one thread here
    std::ifstream file(path("words"));
    std::string words;
    std::getline(file, words);
    EXPECT_THAT(words, HasSubstr(name + " must be a whole number from 0, not \"-1\""));
  }
}

TEST_F(PlanRefusals, AFileThatCannotBeWrittenIsNamedWithTheReason) {
  EXPECT_EQ(write_text("x", path("")).error().message, path("") + " cannot be written (Is a directory)");
  EXPECT_EQ(write_text("x", path("text") + "/x").error().message,
            path("text/x") + " cannot be written (Not a directory)");
}

// Pictures with which all that follows would take minutes and gigabytes.
TEST(PlanInput, SizesThatCannotWorkAreRefusedWithoutLookingAtPixels) {
  const std::vector<StockPanel> stock{test::wood_panel("P", 150, 120, 50.8, 3)};
  const auto refused = [&](Millimetres side, Millimetres patch, double dpi) {
    const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, side, 4)};
    PlanOptions options;
    options.patch = patch, options.dpi = dpi;
    const Status status = check_input(artworks, stock, options);
    return status.ok() ? "" : status.error().message;
  };
  EXPECT_EQ(refused(30_mm, 10_mm, 50.8), "");
  EXPECT_THAT(refused(15000_mm, 10_mm, 25), HasSubstr("would have 3 million patches: choose larger ones"));
  EXPECT_THAT(refused(20_mm, 1_mm, 50.8), HasSubstr("has only 2 x 2 pixels at 50.8 dpi: choose larger patches"));
  EXPECT_EQ(refused(20_mm, 1.5_mm, 50.8), "");
  EXPECT_THAT(refused(9000_mm, 300_mm, 50), HasSubstr("(300.0 x 300.0 mm) are larger than every panel"));
  // The panel's 75 x 60 mm less what is burnt on either side, and on the diagonal.
  EXPECT_EQ(refused(59_mm, 59_mm, 50.8), "");
  EXPECT_THAT(refused(60_mm, 60_mm, 50.8), HasSubstr("larger than every panel"));
}

}  // namespace
}  // namespace veneer::planner
