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
  EXPECT_EQ(flow_text(*lines), "0,5000 10000,5000;2500,0 7500,10000");
  EXPECT_EQ(*flow_lines_of("flow_lines", flow_text(*lines)), *lines);
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
  EXPECT_THAT(drawn(zigzag + R"("/>)").error().message, HasSubstr("701 points, more than 600"));
  EXPECT_THAT(flow_lines_of_drawing({}).error().message, HasSubstr("no page"));
  for (const char* text : {"1,2", "1,2 3", "1,2  3,4", "1,2 3,4;;1,2 3,4", "a,b c,d", "1,2 3,4 ", "1.5,2 3,4",
                           "1,2 3,100001", "1,2;3,4", ";"})
    EXPECT_THAT(flow_lines_of("flow_lines", text).error().message, HasSubstr("flow_lines must be lines of X,Y"))
        << text;
  EXPECT_TRUE(flow_lines_of("flow_lines", "")->empty());
  std::string many = "0,0";
  for (int i = 0; i < 600; ++i) many += fmt::format(" {},{}", i, i);
  EXPECT_THAT(flow_lines_of("flow_lines", many).error().message, HasSubstr("more than 600 points"));
}

}  // namespace
}  // namespace veneer::planner
