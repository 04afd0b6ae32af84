// The small parts of the GRBL driver: window, replies, settings, G-code, motion queue.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "drivers/grbl/fault_text.h"
#include "drivers/grbl/gcode.h"
#include "drivers/grbl/motion_queue.h"
#include "drivers/grbl/reply.h"
#include "drivers/grbl/send_window.h"
#include "drivers/grbl/settings.h"

namespace veneer::grbl {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;

MachineSettings stock_settings(int home_corner = 0, const std::string& options = "V") {
  SettingsReader reader;
  reader.banner({"Grbl 1.1h ['$' for help]"});
  reader.options({options, 15, 128});
  for (const auto& [number, value] : std::map<int, double>{{13, 0},
                                                           {22, 1},
                                                           {23, home_corner},
                                                           {27, 1},
                                                           {30, 1000},
                                                           {32, 1},
                                                           {100, 80},
                                                           {101, 80},
                                                           {110, 24000},
                                                           {111, 24000},
                                                           {120, 1500},
                                                           {121, 1500},
                                                           {130, 520.000},
                                                           {131, 380.000}})
    reader.setting({number, value});
  auto settings = reader.finish();
  EXPECT_TRUE(settings.ok());
  return std::move(settings).value();
}

// ---- send window

RC_GTEST_PROP(SendWindow, NeverHoldsMoreThanTheBuffer, ()) {
  const auto capacity = *rc::gen::inRange<std::size_t>(80, 1024);
  SendWindow window(capacity);
  std::deque<std::size_t> model;
  for (const int step : *rc::gen::container<std::vector<int>>(rc::gen::inRange(-40, 80))) {
    if (step > 0) {
      const std::string line(static_cast<std::size_t>(step), 'x');
      std::size_t held = 0;
      for (const auto length : model) held += length;
      RC_ASSERT(window.fits(line) == (held + line.size() <= capacity));
      if (!window.fits(line)) continue;
      window.sent(line);
      model.push_back(line.size());
    } else {
      RC_ASSERT(window.acknowledged().ok() == !model.empty());
      if (!model.empty()) model.pop_front();
    }
    std::size_t held = 0;
    for (const auto length : model) held += length;
    RC_ASSERT(window.in_flight() == held);
    RC_ASSERT(window.in_flight() <= window.capacity());
    RC_ASSERT(window.lines() == model.size());
  }
}

TEST(SendWindow, CallsAnAnswerToNothingAFault) {
  SendWindow window(128);
  EXPECT_EQ(window.acknowledged().error().code, ErrorCode::kDeviceFault);
  window.sent("G0X1\n");
  EXPECT_TRUE(window.acknowledged().ok());
  EXPECT_FALSE(window.acknowledged().ok());
}

// ---- replies

TEST(Reply, ReadsAStatusReportWithFieldsInAnyOrder) {
  const auto report = std::get<StatusReport>(
      parse_reply("<Hold:1|FS:1200,340|Pn:D|MPos:-12.345,-6.789,0.000|Ov:100,50,90|WCO:1.000,2.000,0.000|Xy:new>"));
  EXPECT_EQ(report.state, "Hold:1");
  EXPECT_TRUE(report.is("Hold"));
  EXPECT_DOUBLE_EQ((*report.machine_position)[0], -12.345);
  EXPECT_DOUBLE_EQ((*report.machine_position)[1], -6.789);
  EXPECT_DOUBLE_EQ(*report.power, 340);
  EXPECT_EQ((*report.overrides)[1], 50);
  EXPECT_DOUBLE_EQ((*report.work_offset)[1], 2);
}

TEST(Reply, HalfReadsNothing) {
  for (const char* line : {"<Run|MPos:-12.3-45,-6.789,0.000|FS:0,0>", "<Run|MPos:,1|FS:0,0>", "<Rnu|MPos:0,0,0>",
                           "<Run|MPos:nan,0,0>", "<Run|MPos:1,2,3|FS:x,0>", "error:", "error:2x", "ALARM:", "$1=", "o",
                           "okk", "[GC:G1 F9x S1]", "garbage", "<>", "[]"})
    EXPECT_TRUE(std::holds_alternative<UnknownReply>(parse_reply(line))) << line;
}

TEST(Reply, KnowsTheBannersOfTheFamilies) {
  for (const char* line : {"Grbl 1.1h ['$' for help]", "GrblHAL 1.1f ['$' or '$HELP' for help]",
                           "Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]"})
    EXPECT_TRUE(std::holds_alternative<Banner>(parse_reply(line))) << line;
}

TEST(Reply, ReadsWhatTheControllerIsAndHowItIsSet) {
  const auto options = std::get<BuildOptions>(parse_reply("[OPT:VNML+,100,1024,3,0]"));
  EXPECT_EQ(options.receive_bytes, 1024U);
  EXPECT_EQ(options.planner_blocks, 100U);
  const auto setting = std::get<SettingLine>(parse_reply("$130=520.000 (x max travel, mm)"));
  EXPECT_EQ(setting.number, 130);
  EXPECT_DOUBLE_EQ(setting.value, 520);
  const auto state = std::get<ParserState>(parse_reply("[GC:G1 G54 G17 G21 G91 G94 M4 M9 T0 F900 S850]"));
  EXPECT_TRUE(state.has("M4"));
  EXPECT_FALSE(state.has("M5"));
  EXPECT_DOUBLE_EQ(state.feed, 900);
  EXPECT_DOUBLE_EQ(state.power, 850);
}

RC_GTEST_PROP(Reply, SurvivesAnyLine, ()) {
  const auto line = *rc::gen::nonEmpty(rc::gen::string<std::string>());
  (void)parse_reply(line);
}

TEST(LineReader, TakesLinesInAnyPieces) {
  std::vector<std::string> lines;
  LineReader reader;
  for (const char* part : {"o", "k\r", "\n<Id", "le>\r\n\r\nerr", "or:3\n"})
    reader.feed(part, [&](std::string_view line) { lines.emplace_back(line); });
  EXPECT_THAT(lines, ::testing::ElementsAre("ok", "<Idle>", "error:3"));
}

TEST(FaultText, NamesNumberMeaningAndFamily) {
  EXPECT_EQ(describe_error(22, Family::kGrbl), "error:22 of Grbl (no feed rate given)");
  EXPECT_EQ(describe_alarm(10, Family::kGrblHal), "ALARM:10 of grblHAL (the emergency stop is pressed)");
  EXPECT_EQ(describe_alarm(10, Family::kFluidNc), "ALARM:10 of FluidNC (the spindle does not answer)");
  EXPECT_EQ(describe_error(152, Family::kFluidNc), "error:152 of FluidNC (the configuration is invalid)");
  EXPECT_EQ(describe_error(60, Family::kGrblHal), "error:60 of grblHAL (the SD card does not mount)");
  EXPECT_EQ(describe_error(60, Family::kGrbl), "error:60 of Grbl (see the firmware's manual)");
}

// ---- settings

TEST(Settings, PutMachineZeroAtTheLowerLeftWhereverHomeIs) {
  for (int corner = 0; corner < 4; ++corner) {
    const auto settings = stock_settings(corner);
    EXPECT_EQ(settings.to_wire(point<MachineFrame>(0, 0)), (WirePoint{-520000, -380000})) << corner;
    EXPECT_EQ(settings.to_wire(point<MachineFrame>(520, 380)), (WirePoint{0, 0})) << corner;
    const auto p = settings.from_wire(-519, -1);
    EXPECT_NEAR(p.x.count(), 1, 1e-9);
    EXPECT_NEAR(p.y.count(), 379, 1e-9);
  }
  EXPECT_DOUBLE_EQ(stock_settings(0).x.home_mm, -1);
  EXPECT_DOUBLE_EQ(stock_settings(1).x.home_mm, -519);
}

TEST(Settings, KeepStrokesOffTheSwitches) {
  const auto upper_right = stock_settings(0).travel();
  EXPECT_DOUBLE_EQ(upper_right.min.x.count(), 0);
  EXPECT_DOUBLE_EQ(upper_right.max.x.count(), 519);
  EXPECT_DOUBLE_EQ(upper_right.max.y.count(), 379);
  const auto lower_left = stock_settings(3).travel();
  EXPECT_DOUBLE_EQ(lower_left.min.x.count(), 1);
  EXPECT_DOUBLE_EQ(lower_left.max.x.count(), 520);
}

TEST(Settings, KnowFirmwareWithItsZeroAtHome) {
  const auto lower_left = stock_settings(3, "VZ");
  EXPECT_EQ(lower_left.to_wire(point<MachineFrame>(10, 20)), (WirePoint{10000, 20000}));
  const auto upper_right = stock_settings(0, "VZ");
  EXPECT_EQ(upper_right.to_wire(point<MachineFrame>(520, 380)), (WirePoint{0, 0}));
}

TEST(Settings, KnowTheFamilyOfAControllerThatPrintedNoBanner) {
  const auto family_with = [](const auto& tell) {
    SettingsReader reader;
    for (const int known : {22, 27, 30, 32, 100, 101, 110, 111, 120, 121, 130, 131})
      reader.setting({known, known == 32 ? 1.0 : known == 27 ? 2.0 : 500.0});
    tell(reader);
    return reader.finish().value();
  };
  EXPECT_EQ(family_with([](SettingsReader& r) { r.version({"1.1h.20190830:"}); }).family, Family::kGrbl);
  EXPECT_EQ(family_with([](SettingsReader& r) { r.firmware({"grblHAL"}); }).family, Family::kGrblHal);
  EXPECT_EQ(family_with([](SettingsReader& r) { r.version({"3.7 FluidNC v3.7.8:"}); }).family, Family::kFluidNc);
  EXPECT_TRUE(family_with([](SettingsReader& r) { r.setting({22, 9}); }).homing) << "grblHAL: bit 0 of more";
  EXPECT_FALSE(family_with([](SettingsReader& r) { r.setting({22, 8}); }).homing);
}

TEST(Settings, RefuseAControllerSetWrongly) {
  for (const auto& [number, value, word] :
       {std::tuple{32, 0.0, "$32=1"}, {13, 1.0, "$13=0"}, {30, 0.0, "$30"}, {130, 0.0, "$130"}, {120, 0.0, "$120"}}) {
    SettingsReader reader;
    reader.banner({"Grbl 1.1h ['$' for help]"});
    for (const int known : {22, 27, 30, 32, 100, 101, 110, 111, 120, 121, 130, 131})
      reader.setting({known, known == 32 ? 1.0 : 500.0});
    reader.setting({27, 1});
    EXPECT_TRUE(reader.finish().ok());
    reader.setting({number, value});
    const auto settings = reader.finish();
    ASSERT_FALSE(settings.ok()) << number;
    EXPECT_EQ(settings.error().code, ErrorCode::kRefused);
    EXPECT_THAT(settings.error().message, HasSubstr(word));
  }
}

void tell_likely(SettingsReader& reader, int but = 0) {
  for (const auto& [number, value] : std::map<int, double>{{22, 1},
                                                           {27, 1},
                                                           {30, 1000},
                                                           {32, 1},
                                                           {100, 80},
                                                           {101, 80},
                                                           {110, 6000},
                                                           {111, 6000},
                                                           {120, 1500},
                                                           {121, 1500},
                                                           {130, 400},
                                                           {131, 300}})
    if (number != but) reader.setting({number, value});
}

// A Reset that fails ends in Aborted, where Clear comes first.
constexpr const char* kFromAborted = ": check the cable, then Clear and Reset";

TEST(Settings, AreBelievedWhenTheyWereToldTwiceAlike) {
  SettingsReader reader;
  tell_likely(reader);
  reader.read_again();
  EXPECT_FALSE(reader.finish().ok()) << "nothing was told the second time";
  tell_likely(reader);
  EXPECT_TRUE(reader.finish().ok());
  reader.setting({30, 100});  // a digit was lost, now or the first time
  const auto settings = reader.finish();
  ASSERT_FALSE(settings.ok());
  EXPECT_EQ(settings.error().code, ErrorCode::kDeviceFault);
  EXPECT_THAT(settings.error().message, AllOf(HasSubstr("$30 differently"), EndsWith(kFromAborted)));
}

TEST(Settings, ThatAreNotToldAreAskedForAgain) {
  SettingsReader reader;
  tell_likely(reader, 30);
  reader.read_again();
  tell_likely(reader, 30);
  const auto settings = reader.finish();
  ASSERT_FALSE(settings.ok());
  EXPECT_THAT(settings.error().message, AllOf(HasSubstr("did not tell its setting $30"), EndsWith(kFromAborted)));
}

// Without $23 the corner would be taken to lie elsewhere, without $13 inches for millimetres.
TEST(Settings, ThatOnlyOneOfTheTwoAnswersHadAreNotGuessed) {
  for (const int lost : {13, 23, 27, 11}) {
    SettingsReader reader;
    tell_likely(reader);
    reader.setting({lost, 1});
    reader.read_again();
    tell_likely(reader, lost);  // its line was garbled this time
    const auto settings = reader.finish();
    ASSERT_FALSE(settings.ok()) << "$" << lost;
    EXPECT_EQ(settings.error().code, ErrorCode::kDeviceFault);
    EXPECT_THAT(settings.error().message, HasSubstr("$" + std::to_string(lost) + " differently"));
  }
  SettingsReader reader;
  reader.read_again();
  tell_likely(reader);
  EXPECT_FALSE(reader.finish().ok()) << "nothing was told the first time";
}

TEST(Settings, SayWhichMachineItIs) {
  const auto identity = [](int number, double value, const char* version = "1.1h.20190825:", bool banner = true) {
    SettingsReader reader;
    if (banner) reader.banner({"GrblHAL 1.1h ['$' for help]"});
    reader.version({version});
    tell_likely(reader);
    reader.setting({number, value});
    return reader.finish().value().identity;
  };
  const std::string usual = identity(11, 0.01);
  EXPECT_EQ(usual, identity(11, 0.02)) << "how it takes corners changes no place";
  EXPECT_THAT(usual, HasSubstr("$130=400"));
  for (const int number : {3, 23, 27, 30, 100, 101, 130, 131, 132}) EXPECT_NE(usual, identity(number, 123)) << number;
  EXPECT_NE(usual, identity(11, 0.01, "1.1h.20190825:left one")) << "its owner's name for it";
  EXPECT_EQ(usual, identity(11, 0.01, "1.1h.20190825:", false)) << "it was running already and printed no banner";
}

TEST(Settings, ThatAreUnlikelyAreTheOperatorsToConfirm) {
  const auto unlikely = [](int number, double value) {
    SettingsReader reader;
    tell_likely(reader);
    reader.setting({number, value});
    return reader.finish().value().unlikely;
  };
  EXPECT_THAT(unlikely(30, 255), ::testing::IsEmpty());
  EXPECT_THAT(unlikely(30, 5), ::testing::ElementsAre("$30 = 5 (full power)"));
  EXPECT_THAT(unlikely(110, 60), ::testing::ElementsAre("$110 = 60 (mm/min in x)"));
  EXPECT_THAT(unlikely(131, 30000), ::testing::ElementsAre("$131 = 30000 (mm of travel in y)"));
}

// ---- G-code

Stroke stroke_of(const std::vector<std::pair<double, double>>& points, double speed = 15, double power = 0.85) {
  Stroke stroke{PieceId{1}, StrokeRole::kCut, {}, MmPerSecond(speed), PowerFraction(power), 1};
  for (const auto& [x, y] : points) stroke.path.push_back(point<MachineFrame>(x, y));
  return stroke;
}

TEST(Gcode, WritesShortLinesWithoutSpacesEndingInNewlineOnly) {
  const auto settings = stock_settings();
  const std::vector<Stroke> strokes = {stroke_of({{10.1234, 20}, {110.5, 20}, {110.5, 50.25}})};
  const auto lines = write_group(strokes, 0, settings.to_wire(point<MachineFrame>(519, 379)), settings, 0.2);
  for (const auto& line : lines) {
    EXPECT_LE(line.text.size(), 80U);
    EXPECT_THAT(line.text, EndsWith("\n"));
    EXPECT_EQ(line.text.find_first_of(" \r"), std::string::npos);
    if (line.moves()) {
      EXPECT_LE(line.longest_s, 0.2 + 1e-6);
    }
    if (line.kind == LineKind::kTravel) {
      EXPECT_THAT(line.text, EndsWith("S0\n")) << "dark moves carry no power";
    }
  }
  EXPECT_EQ(lines.front().text, "G0G17G21G91G94\n");
  EXPECT_EQ(lines[1].text, "G0M4S0\n");
  EXPECT_EQ(lines[lines.size() - 3].text, "G0M5S0\n");
  EXPECT_EQ(lines.back().kind, LineKind::kDwell);
}

TEST(Gcode, AsksWhatWasUnderstoodBeforeItMovesAndOnceItBurns) {
  const auto settings = stock_settings();
  const std::vector<Stroke> strokes = {stroke_of({{10, 20}, {12, 20}}),
                                       stroke_of({{15, 20}, {16, 20}, {16, 21}, {16, 22}}),
                                       stroke_of({{17, 20}, {18, 20}}, 80, 0.2)};
  const auto lines = write_group(strokes, 5, settings.to_wire(point<MachineFrame>(10, 20)), settings, 0.2);
  std::string text;
  for (const auto& line : lines) text += line.text;
  EXPECT_EQ(text,
            "G0G17G21G91G94\nG0M4S0\n"
            "F900\n$G\nG1X2S850\n$G\n"
            "G0X3S0\nG1X1S850\n$G\nY1\nY1\n$G\n"
            "F4800\n$G\nG0X1Y-2S0\nG1X1S200\n$G\n"
            "G0M5S0\nM9\nG4P0.01\n");
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (lines[i].kind != LineKind::kEcho) continue;
    EXPECT_EQ(lines[i].gate, !lines[i - 1].moves()) << i;
  }
}

// Adds up what a controller reads, in its own single precision, as far as the last motion.
RC_GTEST_PROP(Gcode, RoundsSoThatErrorsDoNotAddUp, ()) {
  const auto settings = stock_settings();
  std::vector<std::pair<double, double>> points = {{100, 100}};
  for (const int d : *rc::gen::container<std::vector<int>>(60, rc::gen::inRange(-9999, 9999)))
    points.emplace_back(points.back().first + d / 13333.3, points.back().second + d / 17777.7);
  const std::vector<Stroke> strokes = {stroke_of(points)};
  RC_PRE(check_job({strokes}, settings).ok());
  float x = -420, y = -280;
  for (const auto& line : write_group(strokes, 0, {-420000, -280000}, settings, 0.2)) {
    if (!line.moves() || line.text.find("G53") != std::string::npos) continue;
    for (const char axis : {'X', 'Y'}) {
      const auto at = line.text.find(axis);
      if (at != std::string::npos) (axis == 'X' ? x : y) += std::stof(line.text.substr(at + 1));
    }
    RC_ASSERT(std::abs(x - static_cast<double>(line.to.x_um) / 1000) < 0.0006);
    RC_ASSERT(std::abs(y - static_cast<double>(line.to.y_um) / 1000) < 0.0006);
  }
  RC_ASSERT(std::abs(x + 520 - points.back().first) <= 0.0011);
  RC_ASSERT(std::abs(y + 380 - points.back().second) <= 0.0011);
}

TEST(Gcode, DoesNotDriftInTheControllersSinglePrecisionOverAHundredThousandMoves) {
  // Equal steps whose rounding errors all have one sign: their plain sum ends a tenth of a millimetre off.
  const auto settings = stock_settings();
  std::vector<std::pair<double, double>> points;
  for (int i = 0; i <= 100000; ++i) points.emplace_back(100 + i * 0.003, 100);
  float x = -420, plain = -420;
  for (const auto& line : write_group(std::vector{stroke_of(points)}, 0, {-420000, -280000}, settings, 0.2)) {
    if (line.kind != LineKind::kBurn) continue;
    x += std::stof(line.text.substr(line.text.find('X') + 1));
    plain += 0.003F;
  }
  EXPECT_GT(std::abs(plain - (-120)), 0.05);
  EXPECT_NEAR(x, -120, 0.001);
}

TEST(Gcode, RefusesAJobWithAnythingWrongAnywhere) {
  const auto settings = stock_settings();
  const auto nan = std::numeric_limits<double>::quiet_NaN();
  const auto good = stroke_of({{10, 20}, {12, 20}});
  EXPECT_TRUE(check_job({{good}}, settings).ok());
  EXPECT_FALSE(check_job({}, settings).ok());
  for (const auto& bad : {stroke_of({{10, 20}}), stroke_of({{10, 20}, {10, 20}}), stroke_of({{10, 20}, {519.5, 20}}),
                          stroke_of({{10, 20}, {-0.01, 20}}), stroke_of({{10, 20}, {nan, 20}}),
                          stroke_of({{10, 20}, {12, 20}}, 0), stroke_of({{10, 20}, {12, 20}}, 500),
                          stroke_of({{10, 20}, {12, 20}}, 15, 1.01), stroke_of({{10, 20}, {12, 20}}, 15, nan)})
    EXPECT_EQ(check_job({{good, bad}}, settings).error().code, ErrorCode::kInvalidArgument);
  auto other = good;
  other.piece = PieceId{2};
  EXPECT_FALSE(check_job({{good, other, good}}, settings).ok()) << "strokes of a piece lie together";
  EXPECT_THAT(check_job({{stroke_of({{600, 20}, {610, 20}})}}, settings).error().message, HasSubstr("(600.00, 20.00)"));
}

TEST(Gcode, BurnsAnOpenPathBackAndForthAndAClosedOneRoundAndRound) {
  const auto settings = stock_settings();
  auto open = stroke_of({{10, 20}, {11, 20}, {11, 21}});
  open.passes = 2;
  auto lines = write_group(std::vector{open}, 0, settings.to_wire(point<MachineFrame>(10, 20)), settings, 0.2);
  std::string text;
  for (const auto& line : lines)
    if (line.kind == LineKind::kBurn) text += line.text;
  EXPECT_EQ(text, "G1X1S850\nY1\nY-1\nX-1\n");
}

// ---- motion queue

std::vector<GcodeLine> burns(const std::vector<std::pair<double, double>>& points, double longest_s) {
  const auto settings = stock_settings();
  std::vector<GcodeLine> moves;
  for (auto& line :
       write_group(std::vector{stroke_of(points)}, 0,
                   settings.to_wire(point<MachineFrame>(points[0].first, points[0].second)), settings, longest_s))
    if (line.moves()) moves.push_back(std::move(line));
  return moves;
}

TEST(MotionQueue, CountsAMotionUntilTheMachineIsSeenBehindIt) {
  MotionQueue queue({.longest_s = 1.0, .planner_blocks = 15});
  const auto moves = burns({{100, 100}, {110, 100}, {110, 110}}, 0.2);
  queue.start_at(moves.front().from);
  double sum = 0;
  std::size_t sent = 0;
  while (sent < moves.size() && queue.fits(moves[sent])) {
    queue.sent(moves[sent], {});
    sum += moves[sent++].longest_s;
  }
  EXPECT_LT(sent, moves.size());
  EXPECT_LE(queue.queued_s(), 0.8);
  EXPECT_NEAR(queue.queued_s(), sum, 1e-9);
  EXPECT_TRUE(queue.reported(-420 + 4.0, -280, {}));  // in the second motion of 2.85 mm
  EXPECT_NEAR(queue.queued_s(), sum - moves[0].longest_s, 1e-9);
  EXPECT_FALSE(queue.reported(-420 + 4.0, -279.9, {})) << "beside the path";
  EXPECT_TRUE(queue.take_executed().empty());
}

TEST(MotionQueue, BelievesTheEarliestPlaceOfAPathThatCrossesItself) {
  MotionQueue queue({.longest_s = 10, .planner_blocks = 15});
  const auto moves = burns({{100, 100}, {102, 100}, {102, 102}, {101, 102}, {101, 99}}, 0.2);
  queue.start_at(moves.front().from);
  for (const auto& move : moves) queue.sent(move, {});
  const double all = queue.queued_s();
  EXPECT_TRUE(queue.reported(-420 + 1.0, -280, {}));  // the crossing: in the first motion, and again in the last
  EXPECT_NEAR(queue.queued_s(), all, 1e-9);
  EXPECT_TRUE(queue.reported(-420 + 1.0, -281, {}));
  EXPECT_THAT(queue.take_executed(), ::testing::IsEmpty()) << "its last motion is not over";
  queue.all_executed();
  EXPECT_THAT(queue.take_executed(), ::testing::ElementsAre(0U));
  EXPECT_EQ(queue.queued_s(), 0);
}

// An arc is planned chord by chord, so that its line is answered only near its end: one that creeps is never accepted.
TEST(MotionQueue, AMotionThatIsNotAcceptedInItsTimeIsLate) {
  using std::chrono::milliseconds;
  const auto moves = burns({{100, 100}, {102, 100}, {102, 102}}, 10);
  ASSERT_EQ(moves.size(), 2U);
  MotionQueue queue({});
  queue.start_at(moves[0].from);
  const TimePoint begin{std::chrono::seconds(100)};
  for (const auto& move : moves) queue.sent(move, begin);
  queue.acknowledged(begin);
  const double x = static_cast<double>(moves[0].to.x_um) / 1000, y = static_cast<double>(moves[0].to.y_um) / 1000;
  const double both = moves[0].longest_s + moves[1].longest_s;
  EXPECT_LE(queue.late_s(x, y, begin + milliseconds(10)), 0);
  EXPECT_NEAR(queue.late_s(x, y, begin + milliseconds(3000)), 3 - both, 1e-9);
  queue.set_slowest(0.5, begin);
  EXPECT_NEAR(queue.late_s(x, y, begin + milliseconds(3000)), 3 - 2 * both, 1e-9);
  queue.acknowledged(begin + milliseconds(1000));
  const double end_y = static_cast<double>(moves[1].to.y_um) / 1000;
  EXPECT_LE(queue.late_s(x, end_y, begin + milliseconds(3000)), 0) << "it stands where all ends";
}

TEST(MotionQueue, LetsGoOfShortMotionsThePlannerMustHaveLetGo) {
  MotionQueue queue({.longest_s = 1.0, .planner_blocks = 15});
  std::vector<std::pair<double, double>> points;
  points.reserve(60);
  for (int i = 0; i < 60; ++i) points.emplace_back(100 + 0.05 * i, 100);
  const auto moves = burns(points, 0.2);
  queue.start_at(moves.front().from);
  for (std::size_t i = 0; i < 20; ++i) queue.sent(moves[i], {});
  const double all = queue.queued_s();
  for (int i = 0; i < 15; ++i) queue.acknowledged({});
  EXPECT_NEAR(queue.queued_s(), all, 1e-12);
  queue.acknowledged({});
  EXPECT_NEAR(queue.queued_s(), all - moves[0].longest_s, 1e-9);
  EXPECT_THAT(queue.take_executed(), ::testing::IsEmpty()) << "acknowledgements execute nothing";
}

}  // namespace
}  // namespace veneer::grbl
