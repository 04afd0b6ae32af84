// `veneerctl plan`, as a user runs it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/plan_run.h"

namespace veneer::planner {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::Not;
using ::testing::StartsWith;

class PlanCommand : public PlanRun {};

TEST_F(PlanCommand, WritesPlanPreviewCutFileAndReport) {
  const Outcome outcome = plan(usual() + " --threads 2");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  // Pieces of 7 mm have room for their marks, on two lines.
  EXPECT_THAT(outcome.errors, Not(HasSubstr("do not fit")));
  EXPECT_EQ(json("out/report.json")["warnings"].size(), 0U);
  const auto plan_json = json("out/plan.json"), report = json("out/report.json");
  EXPECT_EQ(plan_json["pieces"].size(), 3U * 5U);  // 31.5 mm / 7 mm = 4.5 columns, rounded up
  EXPECT_EQ(plan_json["panels"][0]["id"], "P");
  EXPECT_DOUBLE_EQ(plan_json["artworks"][0]["width_mm"], 31.5);
  double cost = 0;
  for (const auto& piece : plan_json["pieces"]) cost += piece["cost"].get<double>();
  EXPECT_NEAR(report["cost_total"].get<double>(), cost, 1e-9);
  EXPECT_EQ(report["threads"], 2);
  EXPECT_GT(report["peak_rss_bytes"], 1000000);
  EXPECT_THAT(text("out/cut-P.svg"), HasSubstr("id=\"engrave\""));
  const cv::Mat preview = cv::imread(path("out/preview.png"));
  EXPECT_EQ(preview.cols, 63);
  EXPECT_EQ(preview.rows, 42);
}

// In a log or a pipe there is no bar, but a line for everything that begins.
TEST_F(PlanCommand, TellsItsProgressOffATerminalToo) {
  const Outcome outcome = plan(usual() + " --optimize global --optimize-iterations 4096 --fine-rotation");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  for (const char* line :
       {"reading the wood\n", "\nindexing the wood\n", "\nplacing pieces: ", "\nsurveying the wood\n",
        "\noptimising: ", "\nturning pieces finely\n", "\nplaced 15 of 15 pieces\n"})
    EXPECT_THAT(outcome.errors, HasSubstr(line));
  EXPECT_THAT(outcome.errors, Not(AnyOf(HasSubstr("\r"), HasSubstr("\033"))));
  EXPECT_EQ(text("stdout"), "");
  EXPECT_LT(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 40);

  const Outcome series = run("series " + usual() + " --pictures 2");
  ASSERT_EQ(series.status, 0) << series.errors;
  EXPECT_THAT(series.errors, HasSubstr("in turn, placing pieces: "));
  EXPECT_THAT(series.errors, HasSubstr("2 pictures together, placing pieces: "));
}

// Formats whose codecs are loaded when a file asks for them.
TEST_F(PlanCommand, ReadsLosslessPicturesOfAnyFormatAlike) {
  ASSERT_EQ(plan(usual()).status, 0);
  const std::string expected = text("out/plan.json");
  for (const char* other : {"target.tiff", "target.bmp", "target.ppm"}) {
    cv::imwrite(path(other), cv::imread(path("target.png")));
    const Outcome outcome = plan(replaced("target.png", other));
    ASSERT_EQ(outcome.status, 0) << outcome.errors;
    EXPECT_EQ(text("out/plan.json"), std::string(expected).replace(expected.find("target.png"), 10, other)) << other;
  }
}

TEST_F(PlanCommand, GivesTheSameBytesAgain) {
  ASSERT_EQ(plan(usual() + " --alternatives 2 --threads 1").status, 0);
  const std::string first = text("out/plan.json"), preview = text("out/preview.png"), cut = text("out/cut-P.svg");
  ASSERT_EQ(plan(usual() + " --alternatives 2 --threads 3").status, 0);
  EXPECT_EQ(text("out/plan.json"), first);
  EXPECT_EQ(text("out/cut-P.svg"), cut);
  EXPECT_EQ(text("out/preview.png"), preview);
}

TEST_F(PlanCommand, WarnsOfUnfilledPatchesAndStillSucceeds) {
  // 60 x 90 mm from a panel of 60 x 75 mm.
  const Outcome outcome = plan(replaced("--size-mm 21", "--size-mm 60"));
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.errors, HasSubstr("warning"));
  EXPECT_GT(json("out/report.json")["unfilled"], 0);
}

TEST_F(PlanCommand, WritesOnlyTheFormatsAskedFor) {
  ASSERT_EQ(plan(usual() + " --format json").status, 0);
  EXPECT_FALSE(fs::exists(path("out/cut-P.svg")));
  EXPECT_TRUE(fs::exists(path("out/plan.json")));
}

TEST_F(PlanCommand, TakesSpeciesImportanceAndSeveralPictures) {
  cv::Mat importance(10, 10, CV_8UC1, cv::Scalar(255));
  cv::imwrite(path("importance.png"), importance);
  const std::string panels =
      " --panel " + path("panel.png") + ",dpi=50.8,id=Q,material=oak --material oak --wood-weight oak=2";
  const Outcome outcome = plan(usual() + panels + " --importance " + path("importance.png") +
                               " --repeat 2 --interleave --w-colour 0.2 --w-texture 0.1 --edge-mm 0.8");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto plan_json = json("out/plan.json");
  ASSERT_EQ(plan_json["panels"].size(), 1U);
  EXPECT_EQ(plan_json["panels"][0]["id"], "Q");
  ASSERT_EQ(plan_json["artworks"].size(), 2U);
  EXPECT_EQ(plan_json["artworks"][1]["letter"], "B");
  EXPECT_TRUE(fs::exists(path("out/preview-B.png")));
  EXPECT_TRUE(json("out/report.json")["warnings"].is_array());
}

// The n-th importance is that of the n-th target: what it marks is cheaper than when the other half is marked.
TEST_F(PlanCommand, EachTargetHasItsOwnImportance) {
  cv::imwrite(path("second.png"), test::blob_artwork("B", 60, 40, 20_mm, 9).picture);
  cv::Mat half(40, 60, CV_8UC1, cv::Scalar(20));
  half(cv::Rect(0, 0, 30, 40)).setTo(255);
  cv::imwrite(path("left.png"), half);
  cv::flip(half, half, 1);
  cv::imwrite(path("right.png"), half);
  // Of both pictures' left and right halves.
  const auto costs = [&](const std::string& first, const std::string& second) {
    const Outcome outcome =
        plan(replaced("--patch-mm 7", "--patch-mm 5.25") + " --target " + path("second.png") + " --importance " +
             path(first) + " --importance " + path(second) + " --optimize global --optimize-iterations 40000");
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    const auto made = json("out/plan.json");
    EXPECT_EQ(made["artworks"][1]["target"], path("second.png"));
    std::array<std::array<double, 2>, 2> out{};
    for (const auto& piece : made["pieces"])
      out[piece["artwork"].get<std::size_t>()][piece["col"].get<int>() < 3 ? 0 : 1] += piece["cost"].get<double>();
    return out;
  };
  const auto outer = costs("left.png", "right.png"), inner = costs("right.png", "left.png");
  EXPECT_LT(outer[0][0], inner[0][0]);
  EXPECT_GT(outer[0][1], inner[0][1]);
  EXPECT_GT(outer[1][0], inner[1][0]);
  EXPECT_LT(outer[1][1], inner[1][1]);
}

TEST_F(PlanCommand, NamesThePanelWhoseMarksDoNotFit) {
  // Two halves of the wood, of which neither is enough.
  cv::Mat left = cv::imread(path("mask.png"), cv::IMREAD_GRAYSCALE), right = left.clone();
  left.colRange(left.cols / 2, left.cols) = 0, right.colRange(0, right.cols / 2) = 0;
  cv::imwrite(path("left.png"), left), cv::imwrite(path("right.png"), right);
  std::string arguments = replaced("mask.png", "left.png");
  const std::string seven = "--patch-mm 7";
  arguments.replace(arguments.find(seven), seven.size(), "--patch-mm 3.5 --min-size-mm 3");
  const Outcome outcome =
      plan(arguments + " --panel " + path("panel.png") + ",mask=" + path("right.png") + ",dpi=50.8,id=Q");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.errors, HasSubstr("warning: panel P: "));
  EXPECT_THAT(outcome.errors, HasSubstr("marks do not fit on their pieces"));
  EXPECT_EQ(json("out/report.json")["warnings"].size(), 2U);
  EXPECT_THAT(outcome.errors, HasSubstr("warning: panel Q: "));
}

TEST_F(PlanCommand, ReportsWhatTheGlobalOptimisationGained) {
  const Outcome outcome = plan(usual() + " --optimize global --optimize-iterations 4096");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.errors, HasSubstr("greedy"));
  const auto report = json("out/report.json");
  EXPECT_LE(report["global"]["cost"], report["global"]["greedy_cost"]);
  EXPECT_NEAR(report["global"]["cost"], report["cost_total"], 1e-9 * report["cost_total"].get<double>());
  EXPECT_LE(report["global"]["iterations"], 4096);
  expect_unusable(usual() + " --optimize-seconds -1", "must lie between 0 and 1e9");
}

TEST_F(PlanCommand, AGlobalOptimisationThatTheClockStoppedIsRepeatedByItsIterations) {
  ASSERT_EQ(plan(usual() + " --optimize global --optimize-seconds 0.000001").status, 0);
  const auto report = json("out/report.json");
  EXPECT_EQ(report["global"]["stopped"], true);
  const auto iterations = report["global"]["iterations"].get<std::uint64_t>();
  ASSERT_GT(iterations, 0U);
  const std::string stopped = text("out/plan.json");
  fs::remove_all(path("out"));
  ASSERT_EQ(plan(usual() + " --optimize global --optimize-iterations " + std::to_string(iterations)).status, 0);
  EXPECT_EQ(text("out/plan.json"), stopped);
}

TEST_F(PlanCommand, PlansASeriesOfOnePicture) {
  const Outcome outcome = run("series " + usual() + " --pictures 2");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(json("out/series.json")["columns"].size(), 2U);
  EXPECT_THAT(text("stdout"), HasSubstr("all together"));
  EXPECT_THAT(text("out/series.svg"), HasSubstr("<svg"));
  EXPECT_FALSE(cv::imread(path("out/series.png")).empty());
  const Outcome two = run("series " + usual() + " --target " + path("target.png"));
  EXPECT_EQ(two.status, 2);
  EXPECT_THAT(two.errors, HasSubstr("give one --target"));
}

TEST_F(PlanCommand, ASeriesTakesWhatPlanTakesOrSaysWhyNot) {
  const auto refusal = [&](const std::string& option) {
    const Outcome outcome = run("series " + usual() + " --pictures 1 " + option);
    EXPECT_EQ(outcome.status, 2) << option;
    EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
    return outcome.errors;
  };
  EXPECT_THAT(refusal("--optimize global"), HasSubstr("a series shows what one picture leaves to the next"));
  EXPECT_THAT(refusal("--optimize-seconds 3"), HasSubstr("leave --optimize out, and its limits"));
  EXPECT_THAT(refusal("--alternatives 2"), HasSubstr("leave --alternatives out"));
  EXPECT_THAT(refusal("--repeat 3"), HasSubstr("say how often with --pictures"));
  EXPECT_THAT(refusal("--interleave"), HasSubstr("in turn and together in any case"));
  EXPECT_THAT(refusal("--reserve 0.25"), HasSubstr("leave --reserve out"));
  EXPECT_THAT(refusal("--keep plan.json"), HasSubstr("around no plan that is there"));
  EXPECT_THAT(refusal("--forbid Q,1,1,5,5"), HasSubstr("no panel Q"));
  const Outcome usual_values =
      run("series " + usual() + " --pictures 1 --optimize greedy --alternatives 0 --forbid P,1,1,5,5");
  EXPECT_EQ(usual_values.status, 0) << usual_values.errors;
}

TEST_F(PlanCommand, PlansAgainAroundTheMakersHand) {
  ASSERT_EQ(plan(usual() + " --alternatives 3").status, 0);
  const auto before = json("out/plan.json");
  fs::rename(path("out/plan.json"), path("kept.json"));
  const std::string again = usual() + " --keep " + path("kept.json");
  const auto piece = [](const nlohmann::json& plan, const std::string& mark) {
    for (const auto& it : plan["pieces"])
      if (it["id"] == mark) return it;
    return nlohmann::json();
  };
  ASSERT_FALSE(piece(before, "A1-1")["alternatives"].empty());
  const Outcome outcome = plan(again + " --take A1-1=1 --swap A1-2,A2-1 --replan A2-2 --forbid P,0,0,1,1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto after = json("out/plan.json");
  EXPECT_EQ(piece(after, "A1-1")["panel_outline_mm"], piece(before, "A1-1")["alternatives"][0]["panel_outline_mm"]);
  EXPECT_NE(piece(after, "A1-2")["panel_outline_mm"], piece(before, "A1-2")["panel_outline_mm"]);
  EXPECT_EQ(piece(after, "A3-3")["panel_outline_mm"], piece(before, "A3-3")["panel_outline_mm"]);

  expect_unusable(again + " --pin Z1-1", "no piece Z1-1");
  expect_unusable(again + " --forbid P,1,2,3", "--forbid P,1,2,3 is not");
  expect_unusable(again + " --swap A1-1", "--swap A1-1 is not");
  expect_unusable(again + " --take A1-1=99", "A1-1");
}

TEST_F(PlanCommand, WritesEveryFormatThatIsAskedFor) {
  ASSERT_EQ(plan(usual() + " --format svg,dxf,eps,pdf,json").status, 0);
  EXPECT_THAT(text("out/cut-P.svg"), HasSubstr("<svg"));
  EXPECT_THAT(text("out/cut-P.dxf"), HasSubstr("LWPOLYLINE"));
  EXPECT_THAT(text("out/cut-P.eps"), HasSubstr("lineto\nstroke\n"));
  EXPECT_THAT(text("out/cut-P.pdf"), StartsWith("%PDF-"));
  fs::remove_all(path("out"));
  ASSERT_EQ(plan(usual() + " --format dxf").status, 0);
  EXPECT_TRUE(fs::exists(path("out/cut-P.dxf")) && fs::exists(path("out/plan.json")));
  EXPECT_FALSE(fs::exists(path("out/cut-P.svg")) || fs::exists(path("out/cut-P.eps")));
  for (const std::string name : {"png", "tiff", "DXF", ""})
    expect_unusable(usual() + " --format svg," + name,
                    "\"" + name + "\" is no format of --format: there are svg, dxf, eps, pdf, json");
}

TEST_F(PlanCommand, DrawsTheMapOfAPlan) {
  ASSERT_EQ(plan(usual()).status, 0);
  for (const std::string format : {"pdf", "svg"}) {
    const Outcome drawn = run("map " + path("out/plan.json") + " --out " + path("map." + format));
    EXPECT_EQ(drawn.status, 0) << drawn.errors;
  }
  EXPECT_THAT(text("map.pdf"), StartsWith("%PDF-"));
  EXPECT_THAT(text("map.svg"), HasSubstr("<svg"));
  const auto refused = [&](const std::string& arguments) {
    const Outcome outcome = run("map " + arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    return outcome.errors;
  };
  EXPECT_THAT(refused(path("out/plan.json") + " --out map.doc"), HasSubstr("ends in none of .pdf, .svg and .png"));
  EXPECT_THAT(refused(path("out") + " --out map.pdf"), HasSubstr("name the plan.json in it"));
  EXPECT_THAT(refused(path("out/plan.json") + " --artwork Q --out map.pdf"), HasSubstr("there are A"));
  EXPECT_THAT(refused(path("nothing.json") + " --out map.pdf"), HasSubstr("nothing.json"));
}

// Whoever names a picture by what is engraved on its pieces, or by its letter, gets that picture's map and no other's.
TEST_F(PlanCommand, DrawsTheMapOfThePictureThatIsMeant) {
  const auto words_of_map = [&](const std::string& named) {
    const Outcome drawn = run("map " + path("out/plan.json") + " --artwork " + named + " --out " + path("map.pdf"));
    EXPECT_EQ(drawn.status, 0) << drawn.errors;
    const std::string command =
        "gs -q -dBATCH -dNOPAUSE -dSAFER -sDEVICE=txtwrite -sOutputFile='" + path("map.txt") + "' " + path("map.pdf");
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe,cert-env33-c): one thread
    std::istringstream words(text("map.txt"));
    return std::set<std::string>(std::istream_iterator<std::string>(words), {});
  };
  const auto refusal = [&](const std::string& named) {
    const Outcome outcome = run("map " + path("out/plan.json") + " --artwork " + named + " --out " + path("map.pdf"));
    EXPECT_EQ(outcome.status, 2) << named;
    return outcome.errors;
  };
  ASSERT_EQ(plan(usual() + " --repeat 2").status, 0);
  for (const char* named : {"A", "A2-1"})
    EXPECT_THAT(words_of_map(named), AllOf(Contains("A1-1"), Not(Contains("B1-1"))));
  for (const char* named : {"B", "B2-1"})
    EXPECT_THAT(words_of_map(named), AllOf(Contains("B1-1"), Not(Contains("A1-1"))));

  // A file that is called as the other picture's letter: the letter counts.
  std::string renamed = text("out/plan.json");
  renamed.replace(renamed.find(path("target.png")), path("target.png").size(), "B");
  std::ofstream(path("out/plan.json")) << renamed;
  EXPECT_EQ(json("out/plan.json")["artworks"][0]["target"], "B");
  for (const char* named : {"B", "B2-1"})
    EXPECT_THAT(words_of_map(named), AllOf(Contains("B1-1"), Not(Contains("A1-1"))));

  ASSERT_EQ(plan(usual() + " --repeat 2 --marks short").status, 0);
  const auto pieces = json("out/plan.json")["pieces"];
  ASSERT_EQ(pieces.size(), 30U);
  const std::string of_first = pieces[9]["id"], of_second = pieces[15]["id"];
  EXPECT_EQ(of_first, "1C");
  for (const std::string& named : {std::string("A"), of_first})
    EXPECT_THAT(words_of_map(named), AllOf(Contains(of_first), Not(Contains(of_second))));
  for (const std::string& named : {std::string("B"), of_second})
    EXPECT_THAT(words_of_map(named), AllOf(Contains(of_second), Not(Contains(of_first))));
  EXPECT_THAT(refusal("1"), AllOf(HasSubstr("there are A ("), HasSubstr("), B (")));

  // D is the letter of the fourth picture, and a piece of the third: nobody can know which is meant.
  ASSERT_EQ(plan(replaced("--size-mm 21", "--size-mm 11") + " --repeat 4 --marks short").status, 0);
  EXPECT_EQ(json("out/plan.json")["pieces"][8]["id"], "D");
  EXPECT_THAT(refusal("D"), HasSubstr("D is the letter of one picture of the plan and a mark of another: name"));
  EXPECT_THAT(refusal(path("target.png")), HasSubstr("target.png is the file of 4 pictures of the plan: name the one"));
  EXPECT_THAT(words_of_map("B"), AllOf(Contains("C"), Not(Contains("K"))));
  EXPECT_THAT(words_of_map("K"), AllOf(Contains("K"), Not(Contains("C"))));
}

TEST_F(PlanCommand, KeepsShortMarksAndRefusesOtherOnes) {
  const auto ids = [&] {
    std::vector<std::string> out;
    const nlohmann::json made = json("out/plan.json");
    for (const auto& piece : made["pieces"]) out.push_back(piece["id"]);
    return out;
  };
  ASSERT_EQ(plan(usual() + " --marks short").status, 0);
  const std::vector<std::string> before = ids();
  EXPECT_TRUE(std::ranges::is_sorted(before));
  fs::rename(path("out"), path("first"));
  const std::string again = usual() + " --keep " + path("first/plan.json");
  const Outcome kept = plan(again + " --replan " + before[2]);
  ASSERT_EQ(kept.status, 0) << kept.errors;
  EXPECT_EQ(ids(), before);
  expect_unusable(again + " --pin A1-1", "no piece A1-1");
  expect_unusable(again + " --marks short", "leave --marks out");
  expect_unusable(again + " --marks place", "leave --marks out");
  expect_unusable(usual() + " --marks long", "marks must be place or short, not \"long\"");
}

TEST_F(PlanCommand, DrawsThePictureAtThePanelsOwnResolutionWithItsCuts) {
  const std::string coarse = replaced("--dpi 50.8", "--dpi 25.4");
  const Outcome plain = plan(coarse + " --full-preview");
  ASSERT_EQ(plain.status, 0) << plain.errors;
  const cv::Mat preview = cv::imread(path("out/preview.png")), full = cv::imread(path("out/full.png"));
  EXPECT_NEAR(full.cols, 2 * preview.cols, 1) << "the panel has 50.8 dpi";
  EXPECT_NEAR(full.rows, 2 * preview.rows, 1);
  const Outcome cut = plan(coarse + " --full-preview --cut-lines");
  ASSERT_EQ(cut.status, 0) << cut.errors;
  const cv::Mat lines = cv::imread(path("out/full.png"));
  ASSERT_EQ(lines.size(), full.size());
  cv::Mat drawn;
  cv::absdiff(lines, full, drawn);
  cv::transform(drawn, drawn, cv::Matx13f(1, 1, 1));
  drawn = drawn > 60;
  const double mm = lines.rows / 21.0;  // pixels
  const nlohmann::json pieces = json("out/plan.json")["pieces"];
  ASSERT_FALSE(pieces.empty());
  for (const nlohmann::json& piece : pieces) {
    const auto& outline = piece["artwork_outline_mm"];
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
      const double x = (a[0].get<double>() + b[0].get<double>()) / 2, y = (a[1].get<double>() + b[1].get<double>()) / 2;
      const int column = std::clamp(static_cast<int>(x * mm), 0, drawn.cols - 1),
                row = std::clamp(static_cast<int>(drawn.rows - y * mm), 0, drawn.rows - 1);
      const cv::Rect around = cv::Rect(column - 1, row - 1, 3, 3) & cv::Rect({}, drawn.size());
      EXPECT_GT(cv::countNonZero(drawn(around)), 0) << piece["id"] << " at " << x << ", " << y;
    }
  }
  EXPECT_LT(cv::countNonZero(drawn), static_cast<int>(drawn.total() / 2)) << "the wood is still seen";
  expect_unusable(usual() + " --cut-lines", "--full-preview");
}

TEST_F(PlanCommand, DrawsThePictureAsBuiltAndWhatItIsKeptIn) {
  const Outcome planned = plan(usual() + " --as-built --distance-m 0.5 --putty d8c8a0");
  ASSERT_EQ(planned.status, 0) << planned.errors;
  const cv::Mat preview = cv::imread(path("out/preview.png")), built = cv::imread(path("out/as-built.png"));
  ASSERT_EQ(preview.size(), built.size());
  EXPECT_GT(cv::norm(preview, built, cv::NORM_L1), 0);
  expect_unusable(usual() + " --as-built --putty wood", "write six digits");
  expect_unusable(usual() + " --putty d8c8a0", "--as-built");
  const Outcome drawn = run("mount " + path("out/plan.json") + " --rail-mm 8 --out " + path("mount"));
  EXPECT_EQ(drawn.status, 0) << drawn.errors;
  for (const std::string part : {"back", "tray", "frame"})
    EXPECT_THAT(text("mount/" + part + ".svg"), HasSubstr("<svg")) << part;
  const Outcome refused = run("mount " + path("out/plan.json") + " --rail-mm 1 --out " + path("none"));
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.errors, HasSubstr("would not hold"));
  EXPECT_FALSE(fs::exists(path("none")));
}

TEST_F(PlanCommand, TakesTheValuesThatMeanWhatIsThere) {
  ASSERT_EQ(plan(usual()).status, 0);
  const std::string without = text("out/plan.json");
  fs::remove_all(path("out"));
  const Outcome outcome = plan(usual() + " --layout grid --refine none --curves g0 --overlap-mm 0.0");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(text("out/plan.json"), without);
}

TEST_F(PlanCommand, RefusesUnusableArgumentsInWords) {
  expect_unusable("", "--target");
  expect_unusable(replaced(path("target.png"), path("none.png")), "there is no file");
  expect_unusable(replaced(path("panel.png"), path("none.png")), "there is no file");
  expect_unusable(replaced(path("mask.png"), path("target.png")), "the mask");
  expect_unusable(replaced(path("mask.png"), folder_.string()), "is a directory");
  std::ofstream(path("text.png")) << "no picture";
  expect_unusable(replaced(path("target.png"), path("text.png")), "not a picture");
  cv::imwrite(path("dot.png"), cv::Mat(1, 1, CV_8UC3, cv::Scalar(9, 9, 9)));
  expect_unusable(replaced(path("target.png"), path("dot.png")), "1 x 1 pixels");
  cv::imwrite(path("black.png"), cv::Mat(120, 150, CV_8UC1, cv::Scalar(0)));
  expect_unusable(replaced(path("mask.png"), path("black.png")), "no usable wood");
  expect_unusable(usual() + " --w-edge nan", "edge weight");
  expect_unusable(usual() + " --w-intensity -1", "intensity weight");
  expect_unusable(usual() + " --w-texture much", "w_texture must be a number, not \"much\"");
  expect_unusable(replaced("--rotations 5", "--rotations 2.5"), "rotations must be a whole number");
  expect_unusable(usual() + " --priority edge", "priority must be saliency or center");
  expect_unusable(usual() + " --optimize best", "optimize must be greedy or global");
  expect_unusable(usual() + " --w-hist 2", "histogram weight");
  expect_unusable(replaced("mask=" + path("mask.png"), "mask="), "names no mask");
  expect_unusable(replaced("dpi=50.8", "dpi=zero"), "not a number");
  expect_unusable(usual() + " --size-mm 700", "--size-mm");
  expect_unusable(usual() + " --threads -1", "the number of threads must not be negative");
  expect_unusable(replaced(path("panel.png") + ",mask=" + path("mask.png"), path("dot.png")),
                  "panel P has only 1 x 1 pixels");
  expect_unusable(replaced("--size-mm 21 --patch-mm 7", "--size-mm 700 --patch-mm 700"), "larger than every panel");
  expect_unusable(replaced("--size-mm 21", "--size-mm nan"), "--size-mm");
  expect_unusable(usual() + " --panel " + path("panel.png") + ",id=P", "two panels have the id P");
  expect_unusable(replaced("id=P", "id=a/b"), "cannot be the id");
  expect_unusable(usual() + " --wood elm", "no panel is known to be elm");
  expect_unusable(usual() + " --wood-weight elm", "not MATERIAL=NUMBER");
  expect_unusable(usual() + " --w-colour nan", "colour weight");
  expect_unusable(usual() + " --edge-mm -1", "scale of edges");
  expect_unusable(usual() + " --repeat 0", "--repeat");
  expect_unusable(usual() + " --reserve 1.5", "reserved wood must lie between 0 and 1");
  expect_unusable(usual() + " --adaptive-levels -1", "adaptive levels");
  expect_unusable(usual() + " --adaptive-factor nan", "adaptive factor");
  expect_unusable(usual() + " --importance " + path("target.png") + " --importance " + path("target.png"),
                  "more --importance");
}

TEST_F(PlanCommand, AnImportanceOfOnePixelChangesNothing) {
  ASSERT_EQ(plan(usual()).status, 0);
  const std::string without = text("out/plan.json");
  cv::imwrite(path("dot.png"), cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(255)));
  ASSERT_EQ(plan(usual() + " --importance " + path("dot.png")).status, 0);
  EXPECT_EQ(text("out/plan.json"), without);
}

TEST_F(PlanCommand, FailsWithOneWhenTheResultsCannotBeWritten) {
  std::ofstream(path("in_the_way")) << "a file";
  const Outcome outcome = plan(replaced("--out " + path("out"), "--out " + path("in_the_way")));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.errors, HasSubstr("in_the_way"));
}

TEST_F(PlanCommand, PlansTheDevelopersPicturesWhenTheyAreThere) {
  const fs::path data = fs::path(VENEER_SOURCE) / ".." / "shared" / "data";
  if (!fs::exists(data / "wood" / "panel_small.jpg")) GTEST_SKIP() << "no developer data beside the tree";
  const Outcome outcome =
      plan("--target " + (data / "targets/astronaut_head.png").string() + " --panel " +
           (data / "wood/panel_small.jpg").string() + ",mask=" + (data / "wood/panel_small_mask.png").string() +
           " --size-mm 40 --patch-mm 10 --dpi 75 --out " + path("out"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(json("out/report.json")["unfilled"], 0);
}

}  // namespace
}  // namespace veneer::planner
