// What becomes of drawings: SVG's lines with their transforms.
#include "planner/drawings/drawing.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "planner/drawings/svg_path.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

Drawing svg(const std::string& inner, const std::string& head = R"(width="100mm" height="60mm" viewBox="0 0 100 60")") {
  auto drawing = read_svg(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" " +
      head + ">" + inner + "</svg>");
  EXPECT_TRUE(drawing.ok()) << drawing.error().message;
  return drawing.ok() ? std::move(*drawing) : Drawing{};
}
std::string refusal(const std::string& inner) {
  const auto drawing = read_svg(R"(<svg width="100mm" height="60mm" viewBox="0 0 100 60">)" + inner + "</svg>");
  return drawing.ok() ? "taken" : drawing.error().message;
}
void expect_at(const DrawingPoint& p, double x, double y, double tolerance = 1e-6) {
  EXPECT_NEAR(p[0], x, tolerance);
  EXPECT_NEAR(p[1], y, tolerance);
}

TEST(SvgDrawing, TurnsThePageUpAndTakesItsMillimetres) {
  const Drawing d = svg(R"(<path d="M10,20 L40 20 l0,10 h-30 v-10 z"/>)");
  ASSERT_EQ(d.lines.size(), 1U);
  const auto& p = d.lines[0].points;
  ASSERT_EQ(p.size(), 5U);
  expect_at(p[0], 10, 40);
  expect_at(p[1], 40, 40);
  expect_at(p[2], 40, 30);
  expect_at(p[3], 10, 30);
  expect_at(p[4], 10, 40);
  EXPECT_THAT(d.warnings, IsEmpty());
}

TEST(SvgDrawing, ScalesTheViewBoxToThePage) {
  const Drawing d =
      svg(R"(<line x1="0" y1="0" x2="1000" y2="600"/>)", R"(width="10cm" height="6cm" viewBox="0 0 1000 600")");
  expect_at(d.lines[0].points[0], 0, 60);
  expect_at(d.lines[0].points[1], 100, 0);
  const Drawing inches = svg(R"(<line x1="0" y1="0" x2="96" y2="0"/>)", R"(width="192" height="96")");
  expect_at(inches.lines[0].points[1], 25.4, 25.4);
  EXPECT_THAT(inches.warnings, ::testing::ElementsAre(HasSubstr("96 pixels to the inch")));
}

TEST(SvgDrawing, AppliesTransformsFromTheInsideOut) {
  const Drawing d = svg(R"svg(<g transform="translate(10 20)"><g transform="rotate(90) scale(2,3)">
      <polyline points="1,0 2,0 2,1"/></g></g>)svg");
  const auto& p = d.lines[0].points;
  expect_at(p[0], 10, 60 - 22);
  expect_at(p[1], 10, 60 - 24);
  expect_at(p[2], 10 - 3, 60 - 24);
  const Drawing skewed =
      svg(R"svg(<line x1="0" y1="10" x2="0" y2="20" transform="matrix(1,0,0,1,5,0),skewX(45)"/>)svg");
  expect_at(skewed.lines[0].points[0], 15, 50);
}

TEST(SvgDrawing, FlattensCurvesToAHundredthOfAMillimetre) {
  const Drawing d = svg(R"(<circle cx="50" cy="30" r="20"/><path d="M10 10 A 8 8 0 0 1 26 10"/>
      <path d="M0 30 C 0 14 28.87 1.34 50 30"/><path d="M0,0 q10,10 20,0 t20,0"/>)");
  ASSERT_EQ(d.lines.size(), 4U);
  for (const auto& p : d.lines[0].points) EXPECT_NEAR(std::hypot(p[0] - 50, p[1] - 30), 20, 1e-9);
  const auto& circle = d.lines[0].points;
  for (std::size_t i = 1; i < circle.size(); ++i) {
    const double x = (circle[i][0] + circle[i - 1][0]) / 2 - 50, y = (circle[i][1] + circle[i - 1][1]) / 2 - 30;
    EXPECT_GT(std::hypot(x, y), 20 - kFlatMm * 1.001);
  }
  expect_at(circle.front(), circle.back()[0], circle.back()[1]);
  // The arc bulges upwards: sweep 1 is clockwise on a page whose y points down.
  double top = 0;
  for (const auto& p : d.lines[1].points) top = std::max(top, p[1]);
  EXPECT_NEAR(top, 58, 0.01);
  expect_at(d.lines[1].points.back(), 26, 50);
  // The second of two smooth arcs mirrors the first.
  double lowest = 100, highest = 0;
  for (const auto& p : d.lines[3].points) lowest = std::min(lowest, p[1]), highest = std::max(highest, p[1]);
  EXPECT_NEAR(lowest, 55, 0.01);
  EXPECT_NEAR(highest, 65, 0.01);
}

TEST(SvgDrawing, ReadsNumbersThatStandWithoutAnythingBetween) {
  const Drawing d = svg(R"(<path d="M1.5.5-3e0-2a1 1 0 01.5.5"/>)");
  const auto& p = d.lines[0].points;
  expect_at(p[0], 1.5, 59.5);
  expect_at(p[1], -3, 62);
  expect_at(p.back(), -2.5, 61.5);
}

TEST(SvgDrawing, DrawsRectanglesWithAndWithoutRoundCorners) {
  const Drawing d =
      svg(R"(<rect x="10" y="10" width="20" height="10"/><rect x="50" y="10" width="20" height="10" rx="3"/>)");
  EXPECT_EQ(d.lines[0].points.size(), 5U);
  EXPECT_NEAR(length_of({{d.lines[1]}, {}, {}}), 2 * 14 + 2 * 4 + 2 * 3.14159265 * 3, 0.05);
}

TEST(SvgDrawing, KnowsLayersAndColours) {
  const Drawing d = svg(R"(<g id="g1" inkscape:label="engrave" inkscape:groupmode="layer"><g id="g2">
      <path d="M0 0 H5" style="fill:none; stroke:#F00"/></g></g>
      <g id="cut" stroke="blue"><path d="M0 1 H5"/><path d="M0 2 H5" stroke="none"/></g>)");
  ASSERT_EQ(d.lines.size(), 3U);
  EXPECT_EQ(d.lines[0].layer, "engrave");
  EXPECT_EQ(d.lines[0].colour, "#ff0000");
  EXPECT_EQ(d.lines[1].layer, "cut");
  EXPECT_EQ(d.lines[1].colour, "#0000ff");
  EXPECT_EQ(d.lines[2].colour, "");
}

TEST(SvgDrawing, LeavesOutWhatIsHiddenOrNotDrawn) {
  const Drawing d = svg(R"(<defs><path d="M0 0 H9"/></defs><g style="display:none"><path d="M0 0 H9"/></g>
      <title>a title</title><path d="M0 0 H5"/><path d="M3 3"/>)");
  EXPECT_EQ(d.lines.size(), 1U);
}

TEST(SvgDrawing, RefusesByNameWhatWouldBeBurntOtherwiseThanItLooks) {
  EXPECT_THAT(refusal("<text>hello</text>"), HasSubstr("turn it into paths"));
  EXPECT_THAT(refusal("<image href='x.png'/>"), HasSubstr("trace it"));
  EXPECT_THAT(refusal("<use href='#a'/>"), HasSubstr("unlink it"));
  EXPECT_THAT(refusal("<path d='M0 0 H5' clip-path='url(#c)'/>"), HasSubstr("clip-path"));
  EXPECT_THAT(refusal("<path id='p' d='M0 0 X5'/>"), HasSubstr("\"p\" does not read"));
  EXPECT_THAT(refusal("<path d='M0 0 H5' transform='turn(3)'/>"), HasSubstr("transform"));
  EXPECT_THAT(refusal("<blob/>"), HasSubstr("<blob>"));
  EXPECT_THAT(refusal(""), HasSubstr("no lines"));
  EXPECT_THAT(read_svg("<svg><path d='M0 0 H5'/></svg>").error().message, HasSubstr("says no size"));
  EXPECT_THAT(read_svg("<html/>").error().message, HasSubstr("no <svg>"));
  EXPECT_THAT(read_svg("<svg").error().message, HasSubstr("no SVG"));
}

// Where a viewer stops drawing, so that what would be burnt is not what is seen.
TEST(SvgPath, RefusesCommasThatStandBetweenNoValues) {
  const auto reads = [](const char* data) { return LineDrawer{SvgMatrix{}}.path(data); };
  for (const char* good : {"M1,2L3,4", "M 1 , 2 L 3\n,\n4 Z", "M1,2,3,4", "M0 0A1,1,0,0,1,3,3", "M0 0a1 1 0 01.5.5"})
    EXPECT_TRUE(reads(good)) << good;
  for (const char* bad :
       {"M,1,2", "M1,,2", "M1,2,L3,4", "M1,2L,3,4", "M1,2L3,4,", "M1,2,Z", "M0 0A1 1 0 0,,1 3 3", "M1 +-2"})
    EXPECT_FALSE(reads(bad)) << bad;
  EXPECT_FALSE(parse_numbers("1,,2"));
  EXPECT_FALSE(parse_numbers("1 2,"));
  EXPECT_EQ(parse_numbers(" 1,2 -3.5.5 ")->size(), 4U);
}

// Whatever is in a path's data, it is read or refused, and never long.
TEST(SvgPath, SurvivesData) {
  constexpr std::size_t kMost = 50'000;
  std::string curves = "M0 0";
  for (int i = 0; i < 20; ++i) curves += "q1e9 1e9 2e9 0";
  for (const std::string& data :
       {std::string(), std::string("M"), std::string("M1"), std::string("M1 2 L"), std::string("z"),
        std::string("L1 1"), std::string("M0 0 A1 1 0 2 0 3 3"), std::string("M0 0 A1e300 1e300 0 1 1 1 1"),
        std::string("M0 0 C1 1 1e308 1e308 1e308 1e308"), std::string("M0 0 H nan"), std::string("M0 0 z z z L1 1"),
        std::string("M1 1 1 1 1"), std::string("M0 0 Q1e9 1e9 2e9 0"), std::string("M-0-0-0-0"),
        std::string("M0 0 L\x80\xff"), curves}) {
    LineDrawer draw{SvgMatrix{}, kMost};
    static_cast<void>(draw.path(data));
    EXPECT_EQ(draw.is_full(), data == curves) << data;
    std::size_t points = 0;
    for (const auto& line : draw.take()) points += line.size();
    EXPECT_LE(points, kMost) << data;
  }
}

TEST(SvgPath, KeepsPointsThatAreNoNumbersForItsCallerToRefuse) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  LineDrawer draw{SvgMatrix{}};
  draw.move_to({0, 0});
  draw.line_to({none, 3});
  draw.line_to({5, 5});
  const auto lines = draw.take();
  ASSERT_EQ(lines.size(), 1U);
  ASSERT_EQ(lines[0].size(), 3U);
  EXPECT_TRUE(std::isnan(lines[0][1][0]));
  EXPECT_FALSE(is_finite(svg("<path d='M0 0 H5'/><path d='M1 1 H5' transform='scale(1e200) scale(1e200)'/>")));
}

TEST(SvgDrawing, RefusesMorePointsThanItMayHave) {
  const auto read = [](const std::string& inner, std::size_t most) {
    const auto drawing = read_svg("<svg width='9mm' height='9mm'>" + inner + "</svg>", most);
    return drawing.ok() ? "taken" : drawing.error().message;
  };
  const std::string line = "<path d='M0 0 H5 V5 H0'/>";
  EXPECT_EQ(read(line + line, 8), "taken");
  EXPECT_THAT(read(line + line, 7), HasSubstr("more than 7 points"));
  EXPECT_THAT(read("<circle r='1e9'/>", 1000), HasSubstr("more than 1000 points"));
  EXPECT_THAT(read("<polyline points='0 0 1 1 2 2 3 3'/>", 3), HasSubstr("more than 3 points"));
}

TEST(SvgDrawing, RefusesLengthsThatDoNotReadByElementAndAttribute) {
  for (const char* length : {"50%", "2em", "nan", "inf", "-inf", "1e999", "five", "1 2", "1mm2", ""}) {
    const auto with = [&](const std::string& before, const std::string& behind) {
      return refusal("<" + before + "='" + length + "'" + behind + "/>");
    };
    EXPECT_THAT(with("rect x", " width='5' height='5'"), HasSubstr("the x of a <rect>")) << length;
    EXPECT_THAT(with("rect height", " width='5'"), HasSubstr("the height of a <rect>")) << length;
    EXPECT_THAT(with("rect rx", " width='5' height='5'"), HasSubstr("the rx of a <rect>")) << length;
    EXPECT_THAT(with("line x2", " y2='3'"), HasSubstr("the x2 of a <line>")) << length;
    EXPECT_THAT(with("circle cy", " r='3'"), HasSubstr("the cy of a <circle>")) << length;
    EXPECT_THAT(with("ellipse ry", " rx='3'"), HasSubstr("the ry of a <ellipse>")) << length;
  }
  expect_at(svg("<line x1=' +1e1 ' x2='20'/>").lines.at(0).points[0], 10, 60);
  EXPECT_EQ(svg("<rect rx='auto' ry='auto' width='5' height='5'/>").lines.at(0).points.size(), 5U);
}

TEST(SvgDrawing, DrawsNoRectangleOfNegativeSize) {
  EXPECT_EQ(
      svg("<path d='M0 0 H5'/><rect width='-5' height='5' rx='1'/><rect width='5' height='-5' rx='1'/>").lines.size(),
      1U);
}

TEST(SvgDrawing, KnowsWhatIsFilled) {
  const Drawing d = svg(R"(<g fill="none"><path d="M0 0 H5"/><path d="M0 0 H5" style="fill:red"/></g>
      <path d="M0 0 H5"/><path d="M0 0 H5" fill="transparent"/><line x2="5"/>)");
  std::vector<bool> filled;
  for (const DrawnLine& line : d.lines) filled.push_back(line.filled);
  EXPECT_THAT(filled, ::testing::ElementsAre(false, true, true, false, false));
}

TEST(SvgDrawing, HeedsStyleSheets) {
  // As Illustrator and Inkscape write them.
  const Drawing d = svg(R"(<defs><style type="text/css"><![CDATA[
      @font-face { font-family: Own; src: url(x) }
      /* .st0 { stroke: blue } */ .st0,.st1 { fill: none; stroke:#F00; stroke-width:2 }
      .st1{stroke:lime;}  line { stroke : blue } #last{stroke:cyan} path.st0 {stroke:yellow}
      .hidden { display: none } text > tspan { font-size: 2px } ]]></style></defs>
      <rect class="st0" width="3" height="3"/><rect class="st0 st1" width="3" height="3"/>
      <line x2="5"/><line x2="5" id="last" class="st0"/><path class="st0" d="M0 0H9"/>
      <path class="st0" style="stroke:black;stroke:white !important" d="M0 0H9"/><path stroke="magenta" d="M0 0H9"/>
      <g class="st1"><path d="M0 0H9"/><path class="hidden" d="M0 0H9"/></g>)");
  std::string colours, filled;
  for (const DrawnLine& line : d.lines) {
    colours += line.colour + " ";
    filled += line.filled ? "1" : "0";
  }
  EXPECT_EQ(colours, "#ff0000 #00ff00 #0000ff #00ffff #ffff00 #ffffff #ff00ff #00ff00 ");
  EXPECT_EQ(filled, "00000010");
}

TEST(SvgDrawing, LeavesOutWhatIsHiddenHoweverItIsWritten) {
  for (const char* how : {"style='DISPLAY: None'", "display='NONE'", "display=' none '", "visibility='Hidden'",
                          "visibility='collapse'", "style='display:none ! important'",
                          "style='display:none!IMPORTANT;display:inline'", "style='/* a; */display/**/:none'",
                          "style='display:inline;/*display:inline*/Display:none'", "class='a'", "class='b'"})
    EXPECT_THAT(
        refusal(std::string("<style>.a{Display:None} .b{VISIBILITY:/**/HIDDEN}</style><path d='M0 0H9' ") + how + "/>"),
        HasSubstr("no lines"))
        << how;
}

TEST(SvgDrawing, KnowsStrokesThatNobodySees) {
  const auto colour = [](const std::string& how, const std::string& around = "") {
    const Drawing d = svg("<style>.a{stroke-width:0} .b{stroke-opacity:0} .c{opacity:0}</style><g stroke='red' " +
                          around + "><path d='M0 0H9' " + how + "/></g>");
    return d.lines.empty() ? "left out" : d.lines[0].colour;
  };
  for (const char* unseen : {"stroke-width='0'", "stroke-width=' +0.0mm'", "stroke-opacity='0'", "stroke-opacity='0%'",
                             "opacity='0'", "opacity='-1'", "style='Stroke-Width:0px !important'",
                             "style='stroke-opacity:.0'", "style='opacity:0'", "class='a'", "class='b'", "class='c'"}) {
    EXPECT_EQ(colour(unseen), "") << unseen;
    EXPECT_EQ(colour("", unseen), "") << unseen;
  }
  for (const char* seen :
       {"stroke-width='0.1'", "stroke-opacity='.5'", "opacity='1%'", "opacity='auto'", "stroke-width='nan'"})
    EXPECT_EQ(colour(seen), "#ff0000") << seen;
  EXPECT_EQ(colour("stroke-width='1' stroke-opacity='1'", "stroke-width='0' stroke-opacity='0'"), "#ff0000");
  EXPECT_EQ(colour("opacity='1'", "opacity='0'"), "") << "a group is as seen as it says, whatever is in it";
}

TEST(SvgDrawing, ReadsStyleElementsUnlessTheyAreForPrintAlone) {
  const auto with = [](const std::string& says, const std::string& path = "class='a'") {
    return refusal("<style " + says + ">.a{display:none}</style><path d='M0 0H9' " + path + "/>");
  };
  for (const char* read : {"", "type=''", "type=' Text/CSS '", "media='ALL'", "media=' screen '"})
    EXPECT_THAT(with(read), HasSubstr("no lines")) << read;
  EXPECT_EQ(with("media='Print'"), "taken");
  for (const char* unread : {"screen, print", "not print", "(min-width: 1px)", "print and (color)"})
    EXPECT_THAT(with(std::string("media='") + unread + "'"), HasSubstr(std::string("the media \"") + unread + "\""));
  EXPECT_THAT(with("type='text/less'"), HasSubstr("the type \"text/less\", which is not read"));
}

TEST(SvgDrawing, PassesOverRulesThatChangeNoLine) {
  for (const char* rule :
       {"@keyframes turn { from { display: none } to { display: inline } }", "@-webkit-keyframes a{from{fill:none}}",
        "@page { margin: 0; @top-left { content: '}' } }", "@counter-style own { symbols: '}' }",
        "@media print { path { display: inline } g > path { fill: red } }", "@MEDIA Print{*{display:inline}}",
        "@font-face{src:url(a)}", "@charset 'a;{';", "@namespace url(a);"})
    EXPECT_THAT(refusal(std::string("<style>") + rule + " path{display:none}</style><path d='M0 0H9'/>"),
                HasSubstr("no lines"))
        << rule;
}

TEST(SvgDrawing, RefusesValuesThatAreLongerThanAny) {
  const std::string longest(200, 'a'), longer(201, 'a');
  const auto says = [](const std::string& value, const std::string& where) {
    return where == "sheet"   ? refusal("<style>path{stroke:" + value + "}</style><path d='M0 0H9'/>")
           : where == "style" ? refusal("<path d='M0 0H9' style='stroke:" + value + "'/>")
           : where == "group" ? refusal("<g stroke='" + value + "'><path d='M0 0H9'/></g>")
                              : refusal("<path d='M0 0H9' stroke='" + value + "'/>");
  };
  for (const char* where : {"sheet", "style", "group", "attribute"}) {
    EXPECT_EQ(says(longest, where), "taken") << where;
    EXPECT_THAT(says(longer, where), HasSubstr("a stroke of more than 200 characters")) << where;
  }
  EXPECT_THAT(refusal("<style>path{font-family:" + longer + "}</style><path d='M0 0H9'/>"), "taken");
}

TEST(SvgDrawing, HeedsHowTheWholePageIsDrawn) {
  const Drawing d =
      svg("<path d='M0 0H9V9'/>", R"(width="9mm" height="9mm" viewBox="0 0 9 9" fill="none" stroke="red")");
  ASSERT_EQ(d.lines.size(), 1U);
  EXPECT_FALSE(d.lines[0].filled);
  EXPECT_EQ(d.lines[0].colour, "#ff0000");
}

TEST(SvgDrawing, RefusesStyleSheetsThatItCannotHeed) {
  const auto of_style = [](const std::string& css) { return refusal("<style>" + css + "</style><path d='M0 0H9'/>"); };
  for (const char* rule : {"g > .a", ".a.b", "path:first-child", "[id=a]", ".a\\31"}) {
    EXPECT_THAT(of_style(std::string(rule) + "{fill:none}"),
                HasSubstr(std::string("\"") + rule + "\", which is not read"));
    EXPECT_EQ(of_style(std::string(rule) + "{font-size:3px}"), "taken") << "which changes no line";
  }
  for (const char* rule : {"@media screen { path { display:none } }", "@import url(a.css);", "@supports (a:b) {}",
                           "@layer own;", "@media print and (color) {}"})
    EXPECT_THAT(of_style(rule), ::testing::MatchesRegex(".*the rule @[a-z]+, which is not read.*")) << rule;
  EXPECT_THAT(of_style(".a { stroke: red"), HasSubstr("which is not read: save the drawing with strokes"));
  for (const char* value : {"red !important", "red! IMPORTANT", "red !important; stroke: blue"})
    EXPECT_THAT(of_style(fmt::format(".a {{ stroke: {} }}", value)), HasSubstr("\"red"));
  const auto many = [](int selectors) {
    std::string out = ".a";
    for (int i = 1; i < selectors; ++i) out += fmt::format(",.a{}", i);
    return out + "{fill:none;stroke:red}";
  };
  EXPECT_EQ(of_style(many(100'000)), "taken");
  EXPECT_THAT(of_style(many(100'001)), HasSubstr("more than 100000 selectors"));
  EXPECT_THAT(refusal("<style media='print'>g > .a{fill:none}</style><path d='M0 0H9'/>"), "taken");
  const auto beside = read_svg("<?xml-stylesheet href='a.css'?><svg width='9mm' height='9mm'><path d='M0 0H9'/></svg>");
  ASSERT_FALSE(beside.ok());
  EXPECT_THAT(beside.error().message, HasSubstr("a style sheet in another file"));
}

TEST(SvgDrawing, SurvivesStyleSheetsOfAnyKind) {
  const std::string css = "/*a*/ @font-face{b} .st0, path.st1 > * { fill : none ; stroke: red } @import url(x);";
  for (std::size_t at = 0; at < css.size(); ++at)
    for (const char with : {'{', '}', ';', '@', '*', '/', ',', '.', ':'}) {
      std::string changed = css;
      changed[at] = with;
      static_cast<void>(refusal("<style><![CDATA[" + changed + "]]></style><path class='st0' d='M0 0H9'/>"));
      static_cast<void>(refusal("<style><![CDATA[" + css.substr(0, at) + "]]></style><path d='M0 0H9'/>"));
    }
}

TEST(SvgDrawing, RefusesGroupsWithoutEnd) {
  const auto nested = [](int groups) {
    std::string text;
    for (int i = 0; i < groups; ++i) text += "<g>";
    text += R"(<path d="M 0 0 H 5"/>)";
    for (int i = 0; i < groups; ++i) text += "</g>";
    return text;
  };
  EXPECT_EQ(svg(nested(100)).lines.size(), 1U);
  EXPECT_THAT(refusal(nested(200'000)), HasSubstr("ungroup it"));
}

}  // namespace
}  // namespace veneer::planner
