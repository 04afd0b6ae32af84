// `veneerctl plan --layout`: grids that are morphed, mosaics and segmentations, and how each is kept.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
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

// Cells that are narrower than any piece may be are merged away, whatever their area is.
TEST_F(PlanLayouts, PaintedSizesLeaveLongCellsAsWideAsPiecesMayBe) {
  cv::Mat sizes(40, 60, CV_8UC1, cv::Scalar(0));
  sizes.colRange(36, 60).setTo(255);
  ASSERT_TRUE(cv::imwrite(path("sizes.png"), sizes));
  std::string shape = replaced("--size-mm 21 --patch-mm 7 --dpi 50.8 --rotations 5",
                               "--size-mm 28 --patch-mm 4 --dpi 101.6 --rotations 1");
  shape += " --layout mosaic --min-width-mm 1.5 --min-size-mm 0 --cell-aspect 4 --cell-sizes " + path("sizes.png");
  const Outcome outcome = plan(shape);
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const double pieces = static_cast<double>(json("out/plan.json")["pieces"].size());
  EXPECT_GT(pieces, 0.75 * json("out/report.json")["mosaic"]["tiles"].get<double>());
}

// Somebody paints over the whole target, whatever part of it is rebuilt.
TEST_F(PlanLayouts, HeedsSizesOfCellsInACrop) {
  ASSERT_TRUE(cv::imwrite(path("large.png"), test::blob_artwork("A", 96, 72, 20_mm, 4).picture));
  cv::Mat sizes(36, 48, CV_8UC1, cv::Scalar(0));
  const auto crop = [&](const std::string& part) {
    EXPECT_TRUE(cv::imwrite(path("sizes.png"), sizes));
    return replaced(path("target.png"), path("large.png")) + " --layout mosaic --min-width-mm 1 --cell-sizes " +
           path("sizes.png") + " --crop " + part;
  };
  sizes.colRange(0, 20).setTo(255);
  const Outcome parted = plan(crop("9,0,58,72"));  // half a cell of the mask is left at its left
  EXPECT_EQ(parted.status, 0) << parted.errors;
  const Outcome even = plan(crop("48,0,48,72"));  // black
  EXPECT_EQ(even.status, 0) << even.errors;
  sizes.setTo(255);
  expect_unusable(crop("48,0,48,72"), "are white everywhere");
  sizes = cv::Mat(48, 48, CV_8UC1, cv::Scalar(0));
  sizes.row(3).setTo(255);
  expect_unusable(crop("0,0,72,72"), "have 48 x 48 pixels, and the picture 96 x 72");
}

TEST_F(PlanLayouts, RefusesFlowLinesThatCannotFollowThePicture) {
  const std::string mosaic = usual() + " --layout mosaic --min-width-mm 1 --flow-lines " + path("lines.svg");
  const auto draw = [&](const std::string& page, const std::string& lines) {
    std::ofstream(path("lines.svg")) << "<svg " << page << ">" << lines << "</svg>";
  };
  draw("viewBox='0 0 60 60'", "<path d='M0 5L60 35' fill='none'/>");
  expect_unusable(mosaic, "mm, and the picture 60 x 40 pixels: draw over the picture, on a page of its shape");
  draw("viewBox='0 0 60 40'", "<path d='M40 0V40' fill='none'/>");
  expect_unusable(mosaic + " --crop 0,0,30,40", "no flow line of \"" + path("target.png") + "\" runs over it");
  EXPECT_EQ(plan(mosaic + " --crop 30,0,30,40").status, 0) << "the drawing lies over the whole target";
  draw("width='60mm' height='40mm' viewBox='0 0 60 60'", "<path d='M30 0V60' fill='none'/>");
  const Outcome warned = plan(mosaic);
  EXPECT_EQ(warned.status, 0) << warned.errors;
  EXPECT_THAT(warned.errors, HasSubstr("lines.svg: the drawing's page and its viewBox have different shapes"));
  draw("viewBox='0 0 60 40'", "<g clip-path='url(#a)'><path d='M40 0V40' fill='none'/></g>");
  expect_unusable(mosaic, "has a clip-path, and what it hides would count");
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
  for (const char* shape : {"--cell-aspect 2", "--flow-lines-only"})
    expect_unusable(fmt::format("{} --layout mosaic {} --keep plan.json", usual(), shape),
                    "a plan that is kept keeps its borders: leave --cell-aspect and --flow-lines-only out");
  expect_unusable(usual() + " --layout mosaic --tiles --suggest", "--suggest draws no tiles: leave --tiles out");
  std::ofstream(path("lines.svg")) << "<svg viewBox='0 0 60 40'><text>A</text></svg>";
  expect_unusable(usual() + " --layout mosaic --flow-lines " + path("lines.svg"), "text: turn it into paths");
  expect_unusable(usual() + " --layout mosaic --flow-lines-only", "has none: draw some");
  expect_unusable(usual() + " --layout mosaic --cell-aspect 5", "from 1 to 4 times as long as wide");
  expect_unusable(replaced("--patch-mm 7", "--patch-mm 2.5") + " --layout mosaic --cell-aspect 4",
                  "no part of a piece may be narrower than 1.5 mm: raise --patch-mm, or lower --cell-aspect");
}

TEST_F(PlanLayouts, FlowLinesAndAspectChangeAMosaicAndNothingElse) {
  const std::string mosaic = replaced("--patch-mm 7", "--patch-mm 3.5") + " --layout mosaic --min-width-mm 0.8";
  std::ofstream(path("lines.svg")) << "<svg viewBox='0 0 60 40'><path d='M0 5L60 35' fill='none'/></svg>";
  const std::string lines = " --flow-lines " + path("lines.svg");
  std::map<std::string, std::string> plans;  // by what made them
  for (const std::string& more :
       {std::string(), lines, " --flow-lines-only" + lines, std::string(" --cell-aspect 2.5")}) {
    const Outcome outcome = plan(mosaic + more);
    ASSERT_EQ(outcome.status, 0) << outcome.errors;
    for (const auto& [other, made] : plans) EXPECT_NE(text("out/plan.json"), made) << more << " and " << other;
    plans[more] = text("out/plan.json");
  }
  ASSERT_EQ(plan(usual()).status, 0);
  const std::string before = text("out/plan.json");
  const Outcome squares = plan(usual() + " --cell-aspect 2");
  EXPECT_EQ(squares.status, 0);
  EXPECT_EQ(text("out/plan.json"), before);
  EXPECT_THAT(squares.errors, HasSubstr("only a mosaic's are: choose that layout (--layout mosaic)"));
}

TEST_F(PlanLayouts, NamesWhereDirectionsTurnTooFastForAMosaicsCells) {
  const std::string mosaic = replaced("--patch-mm 7", "--patch-mm 3.5") + " --layout mosaic --min-width-mm 0.8";
  // Rings as large as cells, so many from there on: what of the picture's ninths their cells lie in.
  const auto turning = [&](int left, int width, int height) {
    std::string rings;
    for (int x = left; x < left + width; x += 8)
      for (int y = 4; y < height; y += 8) rings += fmt::format("<circle cx='{}' cy='{}' r='2.5' fill='none'/>", x, y);
    std::ofstream(path("rings.svg")) << "<svg viewBox='0 0 60 40'>" << rings << "</svg>";
    const Outcome outcome = plan(mosaic + " --flow-lines-only --flow-lines " + path("rings.svg"));
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    EXPECT_THAT(outcome.errors, HasSubstr("cells the directions turn by 45 degrees or more"));
    std::map<std::string, int> cells;
    const nlohmann::json report = json("out/report.json");
    for (const nlohmann::json& it : report["mosaic"]["turning"]) cells[it["where"]] += it["cells"].get<int>();
    return cells;
  };
  auto cells = turning(35, 25, 40);  // in the right half
  EXPECT_GT(cells["upper right"] + cells["right"] + cells["lower right"], 5);
  EXPECT_EQ(cells["upper left"] + cells["left"] + cells["lower left"], 0);
  cells = turning(4, 56, 16);  // in the upper half
  EXPECT_GT(cells["upper left"] + cells["top"] + cells["upper right"], 5);
  EXPECT_EQ(cells["lower left"] + cells["bottom"] + cells["lower right"], 0);
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
  // Upright, and in place.
  cv::Mat dark = test::blob_artwork("A", 60, 40, 20_mm, 4).picture;
  dark.setTo(cv::Scalar::all(230));
  dark.rowRange(0, 20).setTo(cv::Scalar::all(20));
  ASSERT_TRUE(cv::imwrite(path("target.png"), dark));
  ASSERT_EQ(plan(mosaic + " --grout 808080").status, 0);
  const cv::Mat halves = cv::imread(path("out/tiles.png"), cv::IMREAD_GRAYSCALE);
  const cv::Range above(0, halves.rows * 2 / 5), below(halves.rows * 3 / 5, halves.rows);
  EXPECT_GT(cv::countNonZero(halves.rowRange(above) < 60), 1000);
  EXPECT_EQ(cv::countNonZero(halves.rowRange(above) > 190), 0);
  EXPECT_GT(cv::countNonZero(halves.rowRange(below) > 190), 1000);
  EXPECT_EQ(cv::countNonZero(halves.rowRange(below) < 60), 0);
}

// Nobody waits for tiles that are not drawn.
TEST_F(PlanLayouts, AMosaicHasNoTilesUnlessTheyAreDrawn) {
  ASSERT_EQ(plan(usual() + " --layout mosaic --min-width-mm 1").status, 0);
  const std::string before = text("out/plan.json");
  EXPECT_TRUE(json("out/report.json")["mosaic"]["tiles_with_joints"].is_null());
  ASSERT_EQ(plan(usual() + " --layout mosaic --min-width-mm 1 --tiles").status, 0);
  EXPECT_EQ(text("out/plan.json"), before);
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
