// `veneerctl plan --layout`: grids that are morphed, mosaics and segmentations, and how each is kept.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/cli/plan_run.h"

namespace veneer::planner {
namespace {

class PlanLayouts : public PlanRun {};

TEST_F(PlanLayouts, RefusesLayoutsThatAreNotThereOrDoNotGoTogether) {
  expect_unusable(usual() + " --layout voronoi", "layout must be grid, morph, mosaic or segmentation, not \"voronoi\"");
  expect_unusable(usual() + " --segmentation x.png", "add --layout segmentation");
  std::ofstream(path("open.svg"))
      << R"(<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9"><path d="M1 1H8V8" fill="none"/></svg>)";
  expect_unusable(usual() + " --layout segmentation --segmentation " + path("open.svg"), "has no closed region");
  expect_unusable(usual() + " --layout mosaic --adaptive-levels 1", "leave them at 0, or choose the layout grid");
}

TEST_F(PlanLayouts, CutsAPictureIntoAMosaicAndKeepsIt) {
  const Outcome outcome = plan(usual() + " --layout mosaic --min-width-mm 1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const nlohmann::json plan_json = json("out/plan.json");
  ASSERT_EQ(plan_json["layouts"].size(), 1U);
  std::size_t number = 0;
  for (const nlohmann::json& piece : plan_json["pieces"]) {
    EXPECT_EQ(piece["id"], "A" + std::to_string(++number));
    EXPECT_TRUE(piece["row"].is_null() && piece["col"].is_null());
    EXPECT_GE(piece["edges"].size(), 2U);
  }
  const nlohmann::json report = json("out/report.json");
  EXPECT_LT(report["mosaic"]["mean_move_px"], 0.1);
  EXPECT_TRUE(fs::exists(path("out/cut-P.svg")) && fs::exists(path("out/preview.png")));
  // Kept without a word of its layout, it is the same plan.
  const std::string before = text("out/plan.json");
  fs::rename(path("out"), path("first"));
  const Outcome kept = plan(usual() + " --keep " + path("first/plan.json"));
  ASSERT_EQ(kept.status, 0) << kept.errors;
  EXPECT_EQ(text("out/plan.json"), before);
}

TEST_F(PlanLayouts, CellsAreSmallWhereSomebodyPaintedIt) {
  cv::Mat sizes(80, 120, CV_8UC1, cv::Scalar(0));
  sizes.colRange(60, 120).setTo(255);
  ASSERT_TRUE(cv::imwrite(path("sizes.png"), sizes));
  const std::string small = replaced("--patch-mm 7", "--patch-mm 3.5") + " --layout mosaic --min-width-mm 0.8";
  const auto pieces_on = [&](bool right) {
    std::ptrdiff_t count = 0;
    const nlohmann::json made = json("out/plan.json");
    for (const nlohmann::json& piece : made["pieces"]) {
      double x = 0;
      for (const nlohmann::json& p : piece["artwork_outline_mm"]) x += p[0].get<double>();
      count += (x / static_cast<double>(piece["artwork_outline_mm"].size()) > 15.75) == right ? 1 : 0;
    }
    return static_cast<double>(count);
  };
  const Outcome outcome = plan(small + " --cell-sizes " + path("sizes.png"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_GT(pieces_on(true), 3 * pieces_on(false));
  cv::flip(sizes, sizes, 1);
  ASSERT_TRUE(cv::imwrite(path("sizes.png"), sizes));
  ASSERT_EQ(plan(small + " --cell-sizes " + path("sizes.png")).status, 0);
  EXPECT_GT(pieces_on(false), 3 * pieces_on(true));
}

TEST_F(PlanLayouts, RefusesSizesAndLinesOfCellsThatCannotBeMeant) {
  const std::string mosaic = usual() + " --layout mosaic --cell-sizes " + path("sizes.png");
  expect_unusable(usual() + " --cell-sizes x.png", "add --layout mosaic");
  expect_unusable(usual() + " --flow-lines x.svg", "add --layout mosaic");
  const auto paint = [&](const cv::Mat& sizes) { ASSERT_TRUE(cv::imwrite(path("sizes.png"), sizes)); };
  paint(cv::Mat(40, 60, CV_8UC1, cv::Scalar(0)));
  expect_unusable(mosaic, "are black everywhere: paint white where cells are to be small");
  paint(cv::Mat(40, 60, CV_8UC1, cv::Scalar(255)));
  expect_unusable(mosaic, "are white everywhere");
  cv::Mat square(50, 50, CV_8UC1, cv::Scalar(0));
  square.row(3).setTo(255);
  paint(square);
  expect_unusable(mosaic, "have 50 x 50 pixels, and the picture 60 x 40: paint them over the picture, in its shape");
  expect_unusable(mosaic + " --keep plan.json", "leave --cell-sizes and --flow-lines out");
  std::ofstream(path("lines.svg")) << "<svg viewBox='0 0 60 40'><text>A</text></svg>";
  expect_unusable(usual() + " --layout mosaic --flow-lines " + path("lines.svg"), "text: turn it into paths");
  expect_unusable(usual() + " --layout mosaic --flow-lines-only", "has none: draw some");
  expect_unusable(usual() + " --layout mosaic --cell-aspect 5", "from 1 to 4 times as long as wide");
  expect_unusable(replaced("--patch-mm 7", "--patch-mm 2.5") + " --layout mosaic --cell-aspect 4",
                  "no part of a piece may be narrower than 1.5 mm");
}

TEST_F(PlanLayouts, FlowLinesAndAspectChangeAMosaicAndNothingElse) {
  const std::string mosaic = replaced("--patch-mm 7", "--patch-mm 3.5") + " --layout mosaic --min-width-mm 0.8";
  ASSERT_EQ(plan(mosaic).status, 0);
  const std::string before = text("out/plan.json");
  std::ofstream(path("lines.svg")) << "<svg viewBox='0 0 60 40'><path d='M0 5L60 35' fill='none'/></svg>";
  for (const std::string& more : {" --flow-lines " + path("lines.svg"), std::string(" --cell-aspect 2.5"),
                                  " --flow-lines-only --flow-lines " + path("lines.svg")}) {
    const Outcome outcome = plan(mosaic + more);
    ASSERT_EQ(outcome.status, 0) << outcome.errors;
    EXPECT_NE(text("out/plan.json"), before) << more;
  }
  const Outcome squares = plan(usual() + " --cell-aspect 2");
  EXPECT_EQ(squares.status, 0);
  EXPECT_THAT(squares.errors, HasSubstr("only a mosaic's are: choose that layout (--layout mosaic)"));
}

TEST_F(PlanLayouts, NamesWhereDirectionsTurnTooFastForAMosaicsCells) {
  const std::string mosaic = replaced("--patch-mm 7", "--patch-mm 3.5") + " --layout mosaic --min-width-mm 0.8";
  std::string rings;  // in the right half, as large as cells
  for (int x = 35; x < 60; x += 8)
    for (int y = 4; y < 40; y += 8) rings += fmt::format("<circle cx='{}' cy='{}' r='2.5' fill='none'/>", x, y);
  std::ofstream(path("rings.svg")) << "<svg viewBox='0 0 60 40'>" << rings << "</svg>";
  const Outcome outcome = plan(mosaic + " --flow-lines-only --flow-lines " + path("rings.svg"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  std::map<std::string, int> cells;
  const nlohmann::json report = json("out/report.json");
  for (const nlohmann::json& it : report["mosaic"]["turning"]) cells[it["where"]] += it["cells"].get<int>();
  EXPECT_GT(cells["upper right"] + cells["right"] + cells["lower right"], 5);
  EXPECT_EQ(cells["upper left"] + cells["left"] + cells["lower left"], 0);
  EXPECT_THAT(outcome.errors, HasSubstr("cells the directions turn by 45 degrees or more"));
  std::ofstream(path("line.svg")) << "<svg viewBox='0 0 60 40'><path d='M0 20H60' fill='none'/></svg>";
  const Outcome calm = plan(mosaic + " --flow-lines-only --flow-lines " + path("line.svg"));
  ASSERT_EQ(calm.status, 0) << calm.errors;
  EXPECT_TRUE(json("out/report.json")["mosaic"]["turning"].empty());
  EXPECT_THAT(calm.errors, ::testing::Not(HasSubstr("the directions turn")));
}

TEST_F(PlanLayouts, DrawsAMosaicAsTilesWithJoints) {
  const std::string mosaic = usual() + " --layout mosaic --min-width-mm 1 --tiles";
  const Outcome outcome = plan(mosaic + " --tile-colour point --grout 102030 --mean-colours");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(cv::imread(path("out/mean.png")).size(), cv::imread(path("out/preview.png")).size());
  const cv::Mat drawn = cv::imread(path("out/tiles.png"));
  ASSERT_FALSE(drawn.empty());
  EXPECT_NEAR(drawn.cols / static_cast<double>(drawn.rows), 1.5, 0.03);
  EXPECT_THAT(text("out/tiles.svg"), HasSubstr("#102030"));
  const nlohmann::json figures = json("out/report.json")["mosaic"]["tiles_with_joints"];
  EXPECT_GT(figures["coverage"], 0.5);
  EXPECT_THAT(outcome.errors, HasSubstr("tiles with joints cover"));
  expect_unusable(usual() + " --tiles", "add --layout mosaic");
  expect_unusable(mosaic + " --grout red", "is no colour");
}

TEST_F(PlanLayouts, RefinesAMosaicAndKeepsIt) {
  const Outcome outcome = plan(usual() + " --layout mosaic --refine dp --min-width-mm 1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const nlohmann::json report = json("out/report.json");
  EXPECT_LE(report["refined"]["cost"], report["refined"]["cost_before"]);
  const std::string before = text("out/plan.json");
  fs::rename(path("out"), path("first"));
  const Outcome kept = plan(usual() + " --keep " + path("first/plan.json"));
  ASSERT_EQ(kept.status, 0) << kept.errors;
  EXPECT_EQ(text("out/plan.json"), before);
}

TEST_F(PlanLayouts, MorphsAGridRefinesAndKeepsIt) {
  const Outcome outcome = plan(usual() + " --layout morph --refine dp --min-width-mm 1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const nlohmann::json plan_json = json("out/plan.json"), report = json("out/report.json");
  ASSERT_EQ(plan_json["layouts"].size(), 1U);
  for (const nlohmann::json& piece : plan_json["pieces"]) {
    const int row = piece["row"], column = piece["col"];
    EXPECT_EQ(piece["id"], "A" + std::to_string(row + 1) + "-" + std::to_string(column + 1));
  }
  EXPECT_GE(report["morph"]["edges_after"], report["morph"]["edges_before"]);
  EXPECT_LE(report["refined"]["cost"], report["refined"]["cost_before"]);
  const std::string before = text("out/plan.json");
  fs::rename(path("out"), path("first"));
  const Outcome kept = plan(usual() + " --keep " + path("first/plan.json"));
  ASSERT_EQ(kept.status, 0) << kept.errors;
  EXPECT_EQ(text("out/plan.json"), before);
}

TEST_F(PlanLayouts, MorphsAGridAsItsGuidesSayAndKeepsItsTriangles) {
  cv::imwrite(path("edges.png"), cv::Mat(60, 60, CV_8UC1, cv::Scalar(255)));
  std::ofstream(path("guides.json")) << R"({"schema_version": 1, "large_edges": "edges.png",
    "vertices": [{"row": 1, "column": 1, "x_mm": 7.5, "y_mm": 13}]})";
  const Outcome outcome =
      plan(usual() + " --layout morph --triangles --min-width-mm 1 --guides " + path("guides.json"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const nlohmann::json plan_json = json("out/plan.json"), report = json("out/report.json");
  EXPECT_TRUE(report["morph"]["split"].is_number_unsigned());
  bool pinned = false;
  for (const nlohmann::json& edge : plan_json["layouts"][0]["edges"])
    pinned = pinned || (std::abs(edge["curve_um"][0][0].get<double>() - 7500) <= 1 &&
                        std::abs(edge["curve_um"][0][1].get<double>() - 13000) <= 1);
  EXPECT_TRUE(pinned);
  std::size_t number = 0;
  for (const nlohmann::json& piece : plan_json["pieces"]) {
    EXPECT_EQ(piece["id"], "A" + std::to_string(++number));
    EXPECT_TRUE(piece["row"].is_null() && piece["col"].is_null());
  }
  const std::string before = text("out/plan.json");
  fs::rename(path("out"), path("first"));
  const Outcome kept = plan(usual() + " --keep " + path("first/plan.json"));
  ASSERT_EQ(kept.status, 0) << kept.errors;
  EXPECT_EQ(text("out/plan.json"), before);
}

TEST_F(PlanLayouts, RefusesGuidesThatNobodyWouldHeed) {
  const auto guides = [&](const std::string& written) {
    std::ofstream(path("guides.json")) << written;
    return usual() + " --layout morph --guides " + path("guides.json");
  };
  expect_unusable(usual() + " --guides x.png", "add --layout morph");
  expect_unusable(guides("[]"), "is not an object of JSON");
  expect_unusable(guides(R"({"large_edge": "x.png"})"), "has \"large_edge\", but only schema_version, large_edges, ");
  expect_unusable(guides(R"({"vertices": [{"row": 1.5, "column": 1, "x_mm": 1, "y_mm": 1}]})"), "vertex 1 of ");
  expect_unusable(guides(R"({"vertices": [{"row": 99, "column": 1, "x_mm": 1, "y_mm": 1}]})"), "is none of the grid's");
  for (const char* version : {"2", "\"1\"", "0"})
    expect_unusable(guides(fmt::format(R"({{"schema_version": {}}})", version)), "or leave it out");
  expect_unusable(guides(R"({"vertices": [{"row": 4294967297, "column": 1, "x_mm": 1, "y_mm": 1}]})"),
                  "row 4294967297: count from 0");
  expect_unusable(guides("{"), "mend the JSON");
  expect_unusable(guides(R"({"large_edges": 3})"), "must be the name of a picture");
  expect_unusable(guides(R"({"vertices": {}})"), "must be a list in square brackets");
  expect_unusable(guides("{}") + " --keep plan.json", "leave --guides out");
  expect_unusable(usual() + " --layout segmentation --segmentation x.svg --keep plan.json", "leave --segmentation out");
}

TEST_F(PlanLayouts, CutsAPictureIntoTheAreasOfAnother) {
  cv::Mat areas(60, 60, CV_8UC3, cv::Scalar(0, 0, 0));
  areas.colRange(30, 60).setTo(cv::Scalar(0, 0, 255));
  areas(cv::Rect(0, 30, 30, 30)).setTo(cv::Scalar(255, 0, 0));
  areas(cv::Rect(10, 10, 2, 2)).setTo(cv::Scalar(9, 9, 9));  // too small to be a piece
  ASSERT_TRUE(cv::imwrite(path("areas.png"), areas));
  const Outcome outcome = plan(usual() + " --layout segmentation --segmentation " + path("areas.png"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(json("out/plan.json")["pieces"].size(), 3U);
  const nlohmann::json report = json("out/report.json");
  EXPECT_TRUE(report["mosaic"].is_null());
  EXPECT_EQ(report["segmentation"]["areas"], 4);
  EXPECT_EQ(report["segmentation"]["merged"], 1);
  const nlohmann::json& merged = report["segmentation"]["largest_merged"].at(0);
  EXPECT_EQ(merged["artwork"], 0);
  EXPECT_NEAR(merged["x_mm"], 31.5 / 60 * 11, 0.6);
  EXPECT_NEAR(merged["y_mm"], 21 - 21.0 / 60 * 11, 0.6);
  EXPECT_NEAR(merged["area_mm2"], 31.5 / 60 * 2 * 21 / 60 * 2, 0.01);
  EXPECT_THAT(outcome.errors, HasSubstr("1 of 4 areas that were drawn are no pieces but went to their neighbours, "
                                        "smaller than a square of 2 mm or thinner than 1.5 mm: 0.73 mm2 at "));
}

// Whatever a patch is: what somebody draws is as large as it is meant to be.
TEST_F(PlanLayouts, KeepsDrawnAreasThatAreSmallerThanAQuarterOfAPatch) {
  cv::Mat areas(100, 150, CV_8UC3, cv::Scalar(0, 0, 0));
  areas.colRange(75, 150).setTo(cv::Scalar(0, 0, 255));
  areas(cv::Rect(20, 30, 27, 27)).setTo(cv::Scalar(255, 0, 0));  // 5.7 mm
  ASSERT_TRUE(cv::imwrite(path("areas.png"), areas));
  const std::string arguments = " --layout segmentation --segmentation " + path("areas.png");
  const Outcome outcome = plan(replaced("--patch-mm 7", "--patch-mm 14") + arguments);
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(json("out/plan.json")["pieces"].size(), 4U) << "what surrounds it is cut in two";
  EXPECT_EQ(json("out/report.json")["segmentation"]["merged"], 0);
  EXPECT_THAT(outcome.errors, ::testing::Not(HasSubstr("areas that were drawn")));
  const Outcome stated = plan(replaced("--patch-mm 7", "--patch-mm 14 --min-size-mm 7") + arguments);
  ASSERT_EQ(stated.status, 0) << stated.errors;
  EXPECT_EQ(json("out/report.json")["segmentation"]["merged"], 1);
  // Nor need a patch of that size fit anywhere.
  EXPECT_EQ(plan(replaced("--patch-mm 7", "--patch-mm 60") + arguments).status, 0);
}

TEST_F(PlanLayouts, TellsLabelsOf16BitsApart) {
  cv::Mat labels(60, 90, CV_16UC1);
  for (int k = 0; k < 3; ++k) labels.colRange(k * 30, k * 30 + 30).setTo(k + 1);
  ASSERT_TRUE(cv::imwrite(path("labels.png"), labels));
  const Outcome outcome = plan(usual() + " --layout segmentation --segmentation " + path("labels.png"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(json("out/plan.json")["pieces"].size(), 3U);
}

TEST_F(PlanLayouts, CutsAPictureIntoTheRegionsOfADrawing) {
  std::ofstream(path("areas.svg")) << R"(<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm"
    viewBox="0 0 60 60"><rect x="0" y="0" width="60" height="60"/><rect x="0" y="0" width="30" height="60"/>
    <path d="M30 30H60V60H30Z"/><path d="M5 5L20 20"/></svg>)";
  const Outcome outcome = plan(usual() + " --layout segmentation --segmentation " + path("areas.svg"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto pieces = json("out/plan.json")["pieces"];
  EXPECT_EQ(pieces.size(), 3U);
}

TEST_F(PlanLayouts, CutsAPictureIntoItsOwnAreasOfOneTone) {
  const Outcome outcome = plan(usual() + " --layout segmentation");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto pieces = json("out/plan.json")["pieces"];
  EXPECT_GT(pieces.size(), 3U);
  EXPECT_TRUE(pieces[0]["row"].is_null());
  const std::string before = text("out/plan.json");
  ASSERT_EQ(plan(usual() + " --layout segmentation").status, 0);
  EXPECT_EQ(text("out/plan.json"), before);
}

}  // namespace
}  // namespace veneer::planner
