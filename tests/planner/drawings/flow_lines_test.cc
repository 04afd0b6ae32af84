// Lines that cells of a mosaic lie along: in a drawing, and in one parameter.
#include "planner/drawings/flow_lines.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <string>

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

std::string page(const std::string& lines) {
  return R"(<svg width="100mm" height="50mm" viewBox="0 0 200 100">)" + lines + "</svg>";
}

Result<std::vector<FlowLine>> drawn(const std::string& lines) {
  const auto drawing = read_svg(page(lines));
  EXPECT_TRUE(drawing.ok()) << drawing.error().message;
  return flow_lines_of_drawing(*drawing);
}

TEST(FlowLines, LieOnThePageAsTheyAreDrawn) {
  const auto lines =
      drawn(R"(<path d="M0 50H200" fill="none" stroke="#000"/><line x1="50" y1="0" x2="150" y2="100"/>)");
  ASSERT_TRUE(lines.ok()) << lines.error().message;
  EXPECT_EQ(*lines, (std::vector<FlowLine>{{{0, 5000}, {10000, 5000}}, {{2500, 0}, {7500, 10000}}}));
  EXPECT_EQ(flow_text({*lines}), "0,5000 10000,5000;2500,0 7500,10000");
  EXPECT_EQ(flow_drawing_of("flow_lines", flow_text({*lines}))->lines, *lines);
}

TEST(FlowLines, APageNeedsNoSizeInMillimetres) {
  const auto drawing = read_svg(R"(<svg viewBox="0 0 40 80"><line x1="0" y1="0" x2="40" y2="80"/></svg>)");
  ASSERT_TRUE(drawing.ok());
  EXPECT_EQ(*flow_lines_of_drawing(*drawing), (std::vector<FlowLine>{{{0, 0}, {10000, 10000}}}));
}

TEST(FlowLines, CurvesHaveAsManyPointsAsTheyNeed) {
  const auto lines = drawn(R"(<circle cx="100" cy="50" r="40" fill="none"/>)");
  ASSERT_TRUE(lines.ok()) << lines.error().message;
  ASSERT_EQ(lines->size(), 1U);
  EXPECT_GT(lines->front().size(), 12U);
  EXPECT_LT(lines->front().size(), 120U);
  for (const FlowPoint& p : lines->front()) {
    const double x = (p.x / 10000.0 - 0.5) * 200, y = (p.y / 10000.0 - 0.5) * 100;
    EXPECT_NEAR(std::hypot(x, y), 40, 0.3);
  }
}

TEST(FlowLines, WhatIsNoneIsRefused) {
  EXPECT_THAT(drawn(R"(<line x1="300" y1="0" x2="400" y2="9"/>)").error().message, HasSubstr("no line on its page"));
  EXPECT_THAT(drawn(R"(<line x1="0" y1="0" x2="1e9" y2="9"/>)").error().message, HasSubstr("far beside its page"));
  std::string zigzag = R"(<path fill="none" d="M0 0)";
  for (int i = 0; i < 700; ++i) zigzag += fmt::format("L{} {}", i % 2 == 0 ? 200 : 0, i / 8.0);
  EXPECT_THAT(drawn(zigzag + R"("/>)").error().message, HasSubstr("need more than 600 points"));
  EXPECT_THAT(flow_lines_of_drawing({}).error().message, HasSubstr("no page"));
  for (const char* text : {"1,2", "1,2 3", "1,2  3,4", "1,2 3,4;;1,2 3,4", "a,b c,d", "1,2 3,4 ", "1.5,2 3,4",
                           "1,2 3,100001", "-2147483648,0 1,1", "1,2;3,4", ";"})
    EXPECT_THAT(flow_drawing_of("flow_lines", text).error().message, HasSubstr("flow_lines must be lines of X,Y"))
        << text;
  EXPECT_TRUE(flow_drawing_of("flow_lines", "")->lines.empty());
  std::string many = "0,0";
  for (int i = 0; i < 600; ++i) many += fmt::format(" {},{}", i, i);
  EXPECT_THAT(flow_drawing_of("flow_lines", many).error().message, HasSubstr("more than 600 points"));
}

// A picture that they are sent with is read by somebody who never saw the drawing.
TEST(FlowLines, TellThePageThatTheyWereDrawnOn) {
  const std::string text = "210.5x140:0,5000 10000,5000;2500,0 7500,10000";
  const auto drawing = flow_drawing_of("flow_lines", text);
  ASSERT_TRUE(drawing.ok()) << drawing.error().message;
  ASSERT_TRUE(drawing->page);
  EXPECT_EQ(*drawing->page, (DrawingPoint{210.5, 140}));
  EXPECT_EQ(drawing->lines, (std::vector<FlowLine>{{{0, 5000}, {10000, 5000}}, {{2500, 0}, {7500, 10000}}}));
  EXPECT_EQ(flow_text(*drawing), text);
  EXPECT_FALSE(flow_drawing_of("flow_lines", "0,5000 10000,5000")->page);
  for (const char* page : {"", "210", "210x", "x140", "0x140", "210x-1", "210xnan", "210xinf", "infx140", "210x1e999",
                           "210x140x3", "210 x 140"})
    EXPECT_THAT(flow_drawing_of("flow_lines", std::string(page) + ":0,5000 10000,5000").error().message,
                HasSubstr("flow_lines must have the page's width and height in mm before the colon, like 210x140"))
        << page;
}

// Only its shape matters: an SVG without a size of its own makes as large a page as its viewBox says.
TEST(FlowLines, LieOnAPageOfAnySize) {
  for (const char* page : {"3e+09x2e+09", "3e-09x2e-09"}) {
    const std::string text = std::string(page) + ":0,5000 10000,5000";
    const auto drawing = flow_drawing_of("flow_lines", text);
    ASSERT_TRUE(drawing.ok()) << drawing.error().message;
    EXPECT_TRUE(check_flow_page("flow_lines", *drawing->page, 600, 400).ok()) << page;
    EXPECT_FALSE(check_flow_page("flow_lines", *drawing->page, 400, 600).ok()) << page;
    EXPECT_EQ(flow_text(*drawing), text);
  }
}

TEST(FlowLines, AreRefusedOnAPageOfAnotherShapeThanThePicture) {
  EXPECT_TRUE(check_flow_page("flow_lines", {210, 140}, 600, 400).ok());
  EXPECT_TRUE(check_flow_page("flow_lines", {210, 140}, 606, 400).ok()) << "a percent is not seen";
  EXPECT_EQ(
      check_flow_page("flow_lines", {210, 140}, 400, 600).error().message,
      "flow_lines: the drawing has a page of 210 x 140 mm, and the picture 400 x 600 pixels: draw over the picture, "
      "on a page of its shape");
}

TEST(FlowLines, MeetThePictureWhereverTheirPointsLie) {
  for (const FlowLine& line : {FlowLine{{-5000, 4000}, {15000, 6000}}, FlowLine{{-100, 9000}, {1500, 10500}},
                               FlowLine{{20000, 0}, {5000, 5000}}, FlowLine{{3000, -9}, {3000, 20000}},
                               FlowLine{{-9, 0}, {5, 0}}, FlowLine{{-9, -9}, {-9, 15000}, {15000, 9}}})
    EXPECT_TRUE(meets_picture(line)) << flow_text({{line}});
  for (const FlowLine& line : {FlowLine{{20000, 20000}, {30000, 30000}}, FlowLine{{-1000, 9500}, {1000, 11500}},
                               FlowLine{{-9, -9}, {-9, 20000}}, FlowLine{{5000, -9}, {20000, -9}, {20000, 9}}})
    EXPECT_FALSE(meets_picture(line)) << flow_text({{line}});
  const auto across = drawn(R"(<line x1="-50" y1="20" x2="250" y2="80"/>)");
  ASSERT_TRUE(across.ok()) << across.error().message;
  EXPECT_EQ(across->size(), 1U);
}

// As many as read_svg() leaves of them, each of which is needed: that they are too many is known after a few hundred.
TEST(FlowLines, AreRefusedOnceTheyNeedTooManyPoints) {
  Drawing drawing;
  drawing.page = {200, 100};
  drawing.lines.resize(1);
  for (std::size_t i = 0; i < kMostDrawnFlowPoints; ++i)
    drawing.lines.front().points.push_back({i % 2 == 0 ? 0.0 : 200.0, 1e-3 * static_cast<double>(i)});
  EXPECT_THAT(flow_lines_of_drawing(drawing).error().message, HasSubstr("need more than 600 points"));
  drawing.lines.assign(301, {});
  for (DrawnLine& line : drawing.lines) line.points = {{0, 0}, {200, 100}};
  EXPECT_THAT(flow_lines_of_drawing(drawing).error().message, HasSubstr("need more than 600 points"));
  drawing.lines.pop_back();
  EXPECT_EQ(flow_lines_of_drawing(drawing)->size(), 300U);
}

}  // namespace
}  // namespace veneer::planner
