// ./dev gallery on a list of two small studies, as a user would start it, and the list that it really shows.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "planner/plan_options.h"
#include "tests/gallery/plan_runs.h"
#include "tests/gallery/studies.h"
#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::gallery {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

json small_studies() {
  return json::parse(R"({
    "schema_version": 1, "title": "Two studies", "lead": "Small ones.",
    "defaults": {"picture": "portrait", "wood": "maple", "size-mm": 40, "patch-mm": 10, "dpi": 50, "rotations": 2},
    "pictures": {"portrait": {"file": "targets/portrait.jpg"}},
    "woods": {"maple": {"file": "wood/maple.jpg", "dpi": 50, "grown": ["maple", "walnut"], "width_mm": 90, "height_mm": 80}},
    "papers": [{"title": "A paper", "by": "Somebody", "studies": [
      {"key": "sizes", "figure": "Figure 1", "title": "Sizes", "look_at": "Look at the pieces.",
       "not_there": ["gold leaf."],
       "views": [{"show": "target", "caption": "Picture"},
                 {"show": "preview", "caption": "<10 mm> & more"},
                 {"show": "mean", "caption": "Mean"},
                 {"show": "lines", "caption": "Cells", "plan": {"layout": "mosaic", "patch-mm": 14}}]},
      {"key": "order", "figure": "Figure 2", "title": "Order", "look_at": "Look at the colours.",
       "views": [{"show": "urgency", "caption": "By saliency"}]}]}]})");
}

struct Made {
  int status = 0;
  std::string output;
  json report;
  std::string page;
};

class GalleryTest : public ::testing::Test {
 protected:
  Made make(const json& studies, const std::vector<std::string>& more = {}) {
    std::ofstream(directory_ / "studies.json") << studies;
    std::vector<std::string> command{VENEER_GALLERY, "--grown",     "--studies", (directory_ / "studies.json").string(),
                                     "--out",        out().string()};
    command.insert(command.end(), more.begin(), more.end());
    const tests::Finished finished = tests::run_program(command);
    Made made{finished.status, finished.output, {}, text_of(out() / "index.html")};
    made.report = json::parse(text_of(out() / "report.json"), nullptr, false);
    return made;
  }

  static std::string text_of(const fs::path& file) {
    std::ifstream in(file);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

  fs::path out() const { return directory_ / "gallery"; }

  testing::TempDirectory directory_;
};

TEST_F(GalleryTest, ShowsEachPlanWithItsPictureAndFigures) {
  const Made made = make(small_studies());
  ASSERT_EQ(made.status, 0) << made.output;
  EXPECT_EQ(made.report.at("failed"), 0);
  const json& view = made.report.at("/studies/0/views/1"_json_pointer);
  // The portrait has 512 x 600 pixels: 40 x 46.875 mm, 4 x 5 patches.
  EXPECT_EQ(view.at("/figures/pieces"_json_pointer), 20);
  EXPECT_EQ(view.at("/figures/unfilled"_json_pointer), 0);
  EXPECT_NEAR(view.at("/figures/wood_cm2"_json_pointer).get<double>(), 18.75, 1e-6);
  const json own = json::parse(text_of(out() / "plans/sizes-2/report.json"));
  EXPECT_EQ(view.at("/figures/preview_cost_per_pixel"_json_pointer), own.at("preview_cost_per_pixel"));
  EXPECT_EQ(view.at("/figures/cost_per_pixel"_json_pointer), own.at("cost_per_pixel"));
  EXPECT_THAT(made.page, HasSubstr(fmt::format("{:.5f}", own.at("preview_cost_per_pixel").get<double>())));
  EXPECT_THAT(made.page, HasSubstr("Look at the pieces."));
  EXPECT_THAT(made.page, HasSubstr("gold leaf."));
  EXPECT_EQ(cv::norm(cv::imread((out() / "pictures/sizes-2.png").string()),
                     cv::imread((out() / "plans/sizes-2/preview.png").string()), cv::NORM_INF),
            0);
  // A plan that two views show is made once; a view of the picture alone needs none.
  EXPECT_TRUE(fs::exists(out() / "plans/sizes-4"));
  EXPECT_FALSE(fs::exists(out() / "plans/sizes-3"));
  EXPECT_TRUE(made.report.at("/studies/1/views/0/figures"_json_pointer).is_null());
}

TEST_F(GalleryTest, WritesAPageWhoseLinksAllLeadToItsOwnFiles) {
  const Made made = make(small_studies());
  ASSERT_EQ(made.status, 0) << made.output;
  pugi::xml_document page;
  ASSERT_TRUE(page.load_string(made.page.c_str(), pugi::parse_default | pugi::parse_doctype));
  std::size_t pictures = 0;
  for (const pugi::xpath_node node : page.select_nodes("//@src | //@href")) {
    const std::string address = node.attribute().value();
    if (address.starts_with('#')) {
      EXPECT_TRUE(page.select_node(fmt::format("//section[@id='{}']", address.substr(1)).c_str())) << address;
      continue;
    }
    EXPECT_TRUE(fs::is_regular_file(out() / address)) << address;
    EXPECT_TRUE(fs::path(address).is_relative()) << address;
    if (std::string(node.attribute().name()) == "src") ++pictures;
  }
  EXPECT_EQ(pictures, 5U);
  // Texts are texts, whatever signs they have.
  EXPECT_STREQ(page.select_node("//figcaption/strong[contains(text(), '10 mm')]").node().text().get(),
               "<10 mm> & more");
}

TEST_F(GalleryTest, NamesTheCommandThatMakesTheSamePlanAgain) {
  const Made made = make(small_studies());
  ASSERT_EQ(made.status, 0) << made.output;
  const std::string before = text_of(out() / "plans/sizes-2/plan.json");
  ASSERT_THAT(before, Not(::testing::IsEmpty()));
  fs::remove(out() / "plans/sizes-2/plan.json");
  const std::string command = made.report.at("/studies/0/views/1/command"_json_pointer);
  const std::string path = fs::path(VENEER_GALLERY).parent_path();
  const tests::Finished again =
      tests::run_program({"/bin/sh", "-c", fmt::format("cd {} && PATH={}:$PATH {}", out().string(), path, command)});
  EXPECT_EQ(again.status, 0) << again.output;
  EXPECT_EQ(text_of(out() / "plans/sizes-2/plan.json"), before);
}

TEST_F(GalleryTest, NamesAStudyThatFailsShowsTheOthersAndExitsWith1) {
  json studies = small_studies();
  studies["/papers/0/studies/0/views/1/plan"_json_pointer] = {{"rotations", 0}};
  const Made made = make(studies);
  EXPECT_EQ(made.status, 1);
  EXPECT_THAT(made.output, HasSubstr("sizes, \"<10 mm> & more\": "));
  EXPECT_EQ(made.report.at("failed"), 1);
  const std::string error = made.report.at("/studies/0/views/1/error"_json_pointer);
  EXPECT_THAT(error, HasSubstr("rotations"));
  EXPECT_THAT(made.page, HasSubstr("This failed: " + error));
  EXPECT_TRUE(made.report.at("/studies/0/views/2/error"_json_pointer).is_null());
  EXPECT_TRUE(fs::exists(out() / "pictures/order-1.jpg"));
}

TEST_F(GalleryTest, MakesOnlyTheStudiesThatAreNamed) {
  const Made made = make(small_studies(), {"--only", "order"});
  ASSERT_EQ(made.status, 0) << made.output;
  EXPECT_EQ(made.report.at("studies").size(), 1U);
  EXPECT_EQ(made.report.at("/studies/0/key"_json_pointer), "order");
  EXPECT_EQ(make(small_studies(), {"--only", "nothing"}).status, 1);
}

TEST_F(GalleryTest, RefusesAListThatSaysWhatMeansNothing) {
  const auto refused = [&](const char* pointer, const json& value) {
    json studies = small_studies();
    studies[json::json_pointer(pointer)] = value;
    const Made made = make(studies);
    EXPECT_EQ(made.status, 1);
    EXPECT_FALSE(fs::exists(out()));
    return made.output;
  };
  EXPECT_THAT(refused("/papers/0/studies/0/views/0/show", "fireworks"), HasSubstr("study sizes: \"fireworks\""));
  EXPECT_THAT(refused("/papers/0/studies/0/colour", "red"), HasSubstr("study sizes: \"colour\" means nothing here"));
  EXPECT_THAT(refused("/papers/0/studies/1/key", "sizes"), HasSubstr("another study has that key"));
  EXPECT_THAT(refused("/papers/0/studies/1/key", "../up"), HasSubstr("small letters"));
  EXPECT_THAT(refused("/defaults/wood", "ebony"), HasSubstr("there is no wood \"ebony\""));
  EXPECT_THAT(refused("/pictures/portrait/crop", {0.5, 0, 0.6, 1}), HasSubstr("must lie within"));
}

// Of `veneerctl plan`, or of the planner.
bool is_option(std::string name) {
  static const std::set<std::string> of_the_command{"size-mm", "repeat", "interleave", "reserve"};
  if (of_the_command.count(name) > 0) return true;
  std::replace(name.begin(), name.end(), '-', '_');
  return std::any_of(planner::kNamedOptions.begin(), planner::kNamedOptions.end(),
                     [&](const auto& option) { return option.name == name; });
}

TEST(Studies, ShowEveryStudyOfThePapersWithOptionsThatThePlannerTakes) {
  const auto studies = read_studies(fs::path(VENEER_SOURCE) / "tests/gallery/studies.json");
  ASSERT_TRUE(studies.ok()) << studies.error().message;
  std::set<std::string> keys;
  for (const Paper& paper : studies->papers)
    for (const Study& study : paper.studies) {
      keys.insert(study.key);
      EXPECT_FALSE(study.views.empty()) << study.key;
      for (const ViewEntry& view : study.views) {
        for (const auto& [name, value] : view.plan.options)
          EXPECT_TRUE(is_option(name)) << study.key << ": veneerctl plan has no --" << name;
        const auto options = plan_options(view.plan);
        ASSERT_TRUE(options.ok()) << study.key << ": " << options.error().message;
        EXPECT_TRUE(planner::check_options(*options).ok()) << study.key << ", " << view.caption;
      }
    }
  std::set<std::string> wanted;
  for (int figure = 5; figure <= 18; ++figure) wanted.insert(fmt::format("figure-{}", figure));
  for (int figure = 6; figure <= 13; ++figure) wanted.insert(fmt::format("mosaic-figure-{}", figure));
  EXPECT_THAT(keys, IsSupersetOf(wanted));
}

}  // namespace
}  // namespace veneer::gallery
