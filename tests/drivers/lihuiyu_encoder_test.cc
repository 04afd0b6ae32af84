// LHYMICRO-GL as it is written, read back by the simulator's interpreter, which shares nothing with the writer.
#include "drivers/lihuiyu/egv_encoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "drivers/lihuiyu/mil_path.h"
#include "drivers/lihuiyu/packet.h"
#include "drivers/lihuiyu/speed_code.h"
#include "tests/support/lihuiyu_decode.h"

namespace veneer::lihuiyu {
namespace {

using tests::decode;
using tests::Decoded;
using tests::farthest;
using tests::MilSegment;
using tests::on_board;

constexpr MilGrid kGrid{300, 200};
constexpr double kHalfMil = 0.5 + 1e-6;

Polyline<MachineFrame> random_path(double spread_mm) {
  const double x = *rc::gen::inRange(20000, 280000) / 1000.0, y = *rc::gen::inRange(20000, 180000) / 1000.0;
  const int n = *rc::gen::inRange(2, 30);
  const auto offset = [&] { return spread_mm * (*rc::gen::inRange(-100000, 100001)) / 100000.0; };
  Polyline<MachineFrame> path;
  for (int i = 0; i < n; ++i) {
    const double across = x + offset(), up = y + offset();
    path.push_back(point<MachineFrame>(across, up));
  }
  return path;
}

Stroke stroke_of(Polyline<MachineFrame> path, double power = 1, double speed = 20, int passes = 1) {
  return {PieceId{1}, StrokeRole::kCut, std::move(path), MmPerSecond(speed), PowerFraction(power), passes};
}

std::vector<MilSegment> burnt(const Decoded& decoded) {
  std::vector<MilSegment> out;
  for (const MilSegment& move : decoded.moves)
    if (move.beam) out.push_back(move);
  return out;
}

double length(const std::vector<MilSegment>& segments) {
  double sum = 0;
  for (const MilSegment& s : segments) sum += std::max(std::abs(s.bx - s.ax), std::abs(s.by - s.ay));
  return sum;
}

TEST(LihuiyuDistance, IsWrittenAsTheBoardReadsIt) {
  EXPECT_EQ(distance_code(1), "a");
  EXPECT_EQ(distance_code(25), "y");
  EXPECT_EQ(distance_code(26), "|a");
  EXPECT_EQ(distance_code(50), "|y");
  EXPECT_EQ(distance_code(51), "|z");
  EXPECT_EQ(distance_code(52), "052");
  EXPECT_EQ(distance_code(254), "254");
  EXPECT_EQ(distance_code(255), "z");
  EXPECT_EQ(distance_code(256), "za");
  EXPECT_EQ(distance_code(510), "zz");
  EXPECT_EQ(distance_code(355), "z100");
  for (int mils = 1; mils < 3000; ++mils) {
    const Decoded decoded = decode("IB" + distance_code(mils) + "R" + distance_code(3001 - mils) + "S1P");
    ASSERT_EQ(decoded.x, mils);
    ASSERT_EQ(decoded.y, 3001 - mils);
    ASSERT_THAT(decoded.complaints, ::testing::IsEmpty());
  }
}

// Codes recorded from the vendor's program, as listed in K40 Whisperer's tests: speed, two bytes, acceleration, steps,
// two bytes.
TEST(LihuiyuSpeed, EqualsTheVendorsCodes) {
  struct Recorded {
    double speed;
    const char* code;
  };
  for (const Recorded& r : {Recorded{5, "CV2352381006000223C"},   Recorded{6, "CV2390691007000159C"},
                            Recorded{6.4, "CV2400801007000149C"}, Recorded{6.99, "CV2411621007000136C"},
                            Recorded{7, "CV0640541008005155"},    Recorded{7.1, "CV0661621008005135"},
                            Recorded{8, "CV0851751009004092"},    Recorded{9, "CV1020991010003125"},
                            Recorded{10, "CV1151921011002219"},   Recorded{15, "CV1552131016001079"},
                            Recorded{20, "CV1752241021000191"},   Recorded{25.4, "CV1881681026000121"},
                            Recorded{30, "CV1952352031000086"},   Recorded{40, "CV2052402041000049"},
                            Recorded{55.5, "CV2140862056000025"}, Recorded{70, "CV2162113071000016"},
                            Recorded{100, "CV2212503101000007"},  Recorded{110, "CV2230183111000006"},
                            Recorded{195, "CV2252144128000003"},  Recorded{200, "CV2252534128000003"}})
    EXPECT_EQ(speed_code(MmPerSecond(r.speed)), r.code) << r.speed << " mm/s";
}

RC_GTEST_PROP(LihuiyuSpeed, IsReadBackAsTheSameSpeed, ()) {
  const double speed = std::exp(*rc::gen::inRange(-916, 5480) / 1000.0);
  RC_PRE(speed >= kSlowestMmPerSecond && speed <= kFastestMmPerSecond);
  const Decoded decoded = decode("I" + speed_code(MmPerSecond(speed)) + "NRBS1EBaU");
  RC_ASSERT(decoded.complaints.empty());
  RC_ASSERT(decoded.moves.size() == 1U);
  const double step = decoded.actions[0].speed.step_seconds();
  RC_ASSERT(std::abs(0.0254 / step / speed - 1) < 0.002);
  // Cut off to whole ticks, so never slower than asked for but for the rounding of the check itself.
  RC_ASSERT(0.0254 / step > speed * (1 - 1e-9));
}

RC_GTEST_PROP(LihuiyuPath, StaysWithinHalfAMilBothWays, ()) {
  const auto path = random_path(*rc::gen::element(0.02, 0.1, 0.5, 3.0));
  const MilPoint start = kGrid.nearest(path.front());
  std::vector<MilSegment> stepped;
  MilPoint at = start;
  for (const StepRun& run : runs_along(path, kGrid)) {
    const MilPoint to{at.x + run.dx * run.length, at.y + run.dy * run.length};
    stepped.push_back({static_cast<double>(at.x), static_cast<double>(at.y), static_cast<double>(to.x),
                       static_cast<double>(to.y), true});
    at = to;
  }
  RC_ASSERT(at == kGrid.nearest(path.back()));
  RC_PRE(!stepped.empty());
  RC_ASSERT(farthest(stepped, on_board(path, 200)) <= kHalfMil);
  RC_ASSERT(farthest(on_board(path, 200), stepped) <= kHalfMil);
}

TEST(LihuiyuPath, KeepsASquareSquare) {
  const auto at = [](double x, double y) { return kGrid.from_board({static_cast<int>(x), static_cast<int>(y)}); };
  const Polyline<MachineFrame> square{at(100, 100), at(400, 100), at(400, 400), at(100, 400), at(100, 100)};
  EXPECT_THAT(runs_along(square, kGrid),
              ::testing::ElementsAre(StepRun{1, 0, 300}, StepRun{0, 1, 300}, StepRun{-1, 0, 300}, StepRun{0, -1, 300}));
  EXPECT_THAT(runs_along({at(0, 0), at(100, 100)}, kGrid), ::testing::ElementsAre(StepRun{1, 1, 100}));
  EXPECT_THAT(runs_along({at(0, 0), at(4, 2)}, kGrid),
              ::testing::ElementsAre(StepRun{1, 1, 1}, StepRun{1, 0, 1}, StepRun{1, 1, 1}, StepRun{1, 0, 1}));
}

TEST(LihuiyuProgram, IsWhatTheProtocolSays) {
  const auto at = [](double x, double y) { return kGrid.from_board({static_cast<int>(x), static_cast<int>(y)}); };
  const Stroke stroke = stroke_of({at(100, 60), at(400, 60), at(400, 90), at(370, 120)});
  const auto programs = write_programs(std::vector{stroke}, 0, {}, kGrid, {.packet_motion_s = 0});
  ASSERT_EQ(programs.size(), 1U);
  EXPECT_EQ(programs[0].text, "ICV1752241021000191B100R060NRBS1EDz|tR|eTM|eUFNSE");
  EXPECT_EQ(programs[0].end, (MilPoint{370, 120}));
  // In packets of 0.1 s, 78 steps: each burns, then is dark to its end.
  const auto packets = write_programs(std::vector{stroke}, 0, {}, kGrid, {.packet_motion_s = 0.1});
  const auto packet = [&](std::size_t i) { return packets[0].text.substr(i * kPayloadBytes, kPayloadBytes); };
  EXPECT_EQ(packet(0), "ICV1752241021000191B100R060NRB");
  EXPECT_EQ(packet(1), "S1EUUUUUUUUUUUUUUUUUUUUUUUUUUU");
  EXPECT_EQ(packet(2), "D078UUUUUUUUUUUUUUUUUUUUUUUUUU");
  EXPECT_EQ(packet(5), "D066RlUUUUUUUUUUUUUUUUUUUUUUUU");
  EXPECT_EQ(packet(6), "DrTM|eUFNSE");
}

// The board may be done with it before a packet that follows has come, and that would clear the news of it.
TEST(LihuiyuProgram, TheEndIsNeverFollowedByAnotherPacket) {
  for (int mils = 1; mils <= 400; ++mils) {
    const Polyline<MachineFrame> line{point<MachineFrame>(50, 100), point<MachineFrame>(50 + 0.0254 * mils, 101)};
    const auto programs = write_programs(std::vector{stroke_of(line)}, 0, {}, kGrid, {.packet_motion_s = 0.1});
    const auto packets = make_packets(programs[0].text);
    EXPECT_NE(packets.back(), make_packet("")) << mils;
    const Decoded decoded = decode(programs[0].text);
    EXPECT_TRUE(decoded.finished && decoded.complaints.empty()) << mils;
  }
}

RC_GTEST_PROP(LihuiyuProgram, BurnsThePathWithinHalfAMil, ()) {
  const auto path = random_path(*rc::gen::element(0.1, 1.0, 4.0));
  RC_PRE(check_job({{stroke_of(path)}}, kGrid).ok());
  const double speed = *rc::gen::element(2.0, 15.0, 80.0, 200.0);
  const MilPoint from{*rc::gen::inRange(0, 8000), *rc::gen::inRange(0, 6000)};
  const auto programs = write_programs(std::vector{stroke_of(path, 1, speed)}, 0, from, kGrid,
                                       {.packet_motion_s = *rc::gen::element(0.0, 0.02, 0.1)});
  RC_ASSERT(programs.size() == 1U);
  const Decoded decoded = decode(programs[0].text, static_cast<double>(from.x), static_cast<double>(from.y));
  RC_ASSERT(decoded.complaints.empty());
  RC_ASSERT(decoded.finished);
  const MilPoint end = kGrid.nearest(path.back());
  RC_ASSERT(decoded.x == static_cast<double>(end.x) && decoded.y == static_cast<double>(end.y));
  RC_ASSERT(programs[0].end == end);
  RC_ASSERT(farthest(burnt(decoded), on_board(path, 200)) <= kHalfMil);
  RC_ASSERT(farthest(on_board(path, 200), burnt(decoded)) <= kHalfMil);
}

RC_GTEST_PROP(LihuiyuProgram, EveryPacketEndsDarkAndIsShort, ()) {
  const auto path = random_path(*rc::gen::element(0.2, 2.0, 8.0));
  const double speed = *rc::gen::element(1.0, 15.0, 80.0, 240.0), longest = *rc::gen::element(0.02, 0.1, 0.3);
  RC_PRE(check_job({{stroke_of(path)}}, kGrid).ok());
  const auto programs = write_programs(std::vector{stroke_of(path, *rc::gen::element(1.0, 0.37), speed, 2)}, 0, {},
                                       kGrid, {.packet_motion_s = longest});
  sim::GlInterpreter interpreter;
  for (std::size_t at = 0; at < programs[0].text.size(); at += kPayloadBytes) {
    interpreter.feed(std::string_view(programs[0].text).substr(at, kPayloadBytes));
    RC_ASSERT(!interpreter.beam());
    double seconds = 0;
    for (const sim::GlAction& action : interpreter.take_actions())
      if (action.compact)
        seconds +=
            static_cast<double>(std::max(std::abs(action.dx), std::abs(action.dy))) * action.speed.step_seconds();
    RC_ASSERT(seconds <= std::max(longest, 0.0254 / speed) * 1.001);
  }
}

// Both strokes of a program alike, and to both their ends: no place is farther from a pulse than half the steps there
// are to one.
RC_GTEST_PROP(LihuiyuProgram, AnM2IsPulsedForTheWantedShareOfTheSteps, ()) {
  const auto path = random_path(*rc::gen::element(0.2, 1.0));
  const double power = *rc::gen::inRange(5, 100) / 100.0;
  Polyline<MachineFrame> beside = path;
  for (auto& p : beside) p.x += Millimetres(10);
  RC_PRE(check_job({{stroke_of(path), stroke_of(beside)}}, kGrid).ok());
  const auto programs = write_programs(std::vector{stroke_of(path, power), stroke_of(beside, power)}, 0, {}, kGrid, {});
  RC_ASSERT(programs.size() == 1U);
  const auto all = burnt(decode(programs[0].text));
  for (const auto& stroke : {path, beside}) {
    const double near_x = kGrid.to_board(stroke.front()).first;
    std::vector<MilSegment> lit;
    for (const MilSegment& s : all)
      if (std::abs(s.bx - near_x) < 5 / kMillimetresPerMil) lit.push_back(s);
    double steps = 0;
    for (const StepRun& run : runs_along(stroke, kGrid)) steps += static_cast<double>(run.length);
    const double pulses = std::max(1.0, std::round(power * steps));
    RC_ASSERT(length(lit) == pulses);
    RC_ASSERT(farthest(lit, on_board(stroke, 200)) <= kHalfMil);
    RC_ASSERT(farthest(on_board(stroke, 200), lit) <= kHalfMil + std::ceil(steps / pulses) / 2);
  }
}

TEST(LihuiyuProgram, StrokesOfOneSettingShareAProgramAndPassesRepeat) {
  const auto line = [](double x) {
    return Polyline<MachineFrame>{point<MachineFrame>(x, 100), point<MachineFrame>(x + 10, 103)};
  };
  const std::vector<Stroke> strokes{stroke_of(line(50), 0.2, 80), stroke_of(line(70), 0.2, 80),
                                    stroke_of(line(50), 0.9, 15, 3)};
  const auto programs = write_programs(strokes, 7, {10, 10}, kGrid, {.board = Board::kM3});
  ASSERT_EQ(programs.size(), 2U);
  EXPECT_EQ(programs[0].first_stroke, 7U);
  EXPECT_EQ(programs[0].stroke_count, 2U);
  EXPECT_EQ(programs[0].power_permille, 200);
  EXPECT_EQ(programs[1].first_stroke, 9U);
  EXPECT_EQ(programs[1].power_permille, 900);
  EXPECT_EQ(programs[1].begin, programs[0].end);
  const Decoded cut = decode(programs[1].text);
  EXPECT_NEAR(length(burnt(cut)), 3 * 10 / 0.0254, 3);
  EXPECT_GT(programs[1].shortest_s, 3 * 10 / 15.0);
  EXPECT_THAT(cut.complaints, ::testing::IsEmpty());
}

TEST(LihuiyuEgv, HasTheVendorsHeaderAndReadsBack) {
  const auto line = [](double x) {
    return Polyline<MachineFrame>{point<MachineFrame>(x, 100), point<MachineFrame>(x + 10.01, 103)};
  };
  const LaserJob job{{stroke_of(line(50), 1, 80), stroke_of(line(70), 1, 15), stroke_of(line(90), 1, 5)}};
  const std::string file = write_egv(job, kGrid);
  EXPECT_EQ(file.find("Document type : LHYMICRO-GL file\n"), 0U);
  // Three lines and five per cent signs stand before the code; it holds one I and one end.
  std::size_t code = 0;
  for (int signs = 0; signs < 5; ++code) signs += file[code] == '%' ? 1 : 0;
  const std::string text = file.substr(code, file.size() - code - 1);
  EXPECT_EQ(std::count(text.begin(), text.end(), 'I'), 1);
  EXPECT_EQ(text.substr(text.size() - 4), "FNSE");
  const Decoded decoded = decode(text);
  EXPECT_THAT(decoded.complaints, ::testing::IsEmpty());
  EXPECT_TRUE(decoded.finished);
  for (const Stroke& stroke : job.strokes) EXPECT_LE(farthest(on_board(stroke.path, 200), burnt(decoded)), kHalfMil);
  std::vector<MilSegment> all;
  for (const Stroke& stroke : job.strokes)
    for (const MilSegment& s : on_board(stroke.path, 200)) all.push_back(s);
  EXPECT_LE(farthest(burnt(decoded), all), kHalfMil);
  // Each part at its own speed: the last move of the last part at 5 mm/s.
  EXPECT_NEAR(0.0254 / decoded.actions[decoded.actions.size() - 2].speed.step_seconds(), 5, 0.01);
}

TEST(LihuiyuJob, IsCheckedWhole) {
  const auto message = [](const Stroke& stroke) {
    const Status status = check_job({{stroke}}, kGrid);
    return status.ok() ? std::string() : status.error().message;
  };
  const Polyline<MachineFrame> good{point<MachineFrame>(10, 10), point<MachineFrame>(20, 10)};
  EXPECT_EQ(message(stroke_of(good)), "");
  EXPECT_THAT(message(stroke_of({good[0]})), ::testing::HasSubstr("fewer than two points"));
  EXPECT_THAT(message(stroke_of({good[0], good[0]})), ::testing::HasSubstr("no length"));
  EXPECT_THAT(message(stroke_of(good, 1.2)), ::testing::HasSubstr("power"));
  EXPECT_THAT(message(stroke_of(good, 1, 0.3)), ::testing::HasSubstr("0.4 to 240 mm/s"));
  EXPECT_THAT(message(stroke_of(good, 1, 241)), ::testing::HasSubstr("0.4 to 240 mm/s"));
  EXPECT_THAT(message(stroke_of(good, 1, 20, 0)), ::testing::HasSubstr("passes"));
  EXPECT_THAT(message(stroke_of({good[0], point<MachineFrame>(301, 10)})), ::testing::HasSubstr("leaves the machine"));
  EXPECT_THAT(message(stroke_of({good[0], point<MachineFrame>(std::nan(""), 10)})),
              ::testing::HasSubstr("leaves the machine"));
}

TEST(LihuiyuPacket, IsCheckedByTheOneWireCrc) {
  const auto crc = [](const char* payload) { return static_cast<std::uint8_t>(make_packet(payload).back()); };
  EXPECT_EQ(crc("IPP"), 0xE4);
  EXPECT_EQ(crc("IS2P"), 0x0F);
  EXPECT_EQ(crc("I"), 0x82);
  EXPECT_EQ(crc(""), 0x50);
  // The catalogue's check value of CRC-8/MAXIM-DOW.
  EXPECT_EQ(crc8("123456789"), 0xA1);
  EXPECT_EQ(home_packet(), std::string("\xA6\x00IPPFFFFFFFFFFFFFFFFFFFFFFFFFFF\xA6\xE4", 34));
  EXPECT_EQ(power_packet(850), make_packet(std::string("AT1\x03\x58", 5), '\0'));
  EXPECT_EQ(power_packet(850).size(), 34U);
}

TEST(LihuiyuPacket, AFullLastPacketIsFollowedByAnEmptyOne) {
  EXPECT_EQ(make_packets(std::string(29, 'U')).size(), 1U);
  const auto packets = make_packets(std::string(60, 'U'));
  ASSERT_EQ(packets.size(), 3U);
  EXPECT_EQ(packets[2], make_packet(""));
}

TEST(LihuiyuPacket, ReadsTheBoardsLines) {
  const auto state = [](int lines) -> std::optional<BoardState> {
    const auto status = parse_status(std::string("\xFF") + static_cast<char>(lines) + std::string("\x6F\x08\x13\0", 4));
    if (!status) return std::nullopt;
    return status->state;
  };
  EXPECT_EQ(state(0xCE), BoardState::kReady);
  EXPECT_EQ(state(0xEE), BoardState::kBusy);
  EXPECT_EQ(state(0xCF), BoardState::kRejected);
  EXPECT_EQ(state(0xEC), BoardState::kFinished);
  EXPECT_EQ(state(0xCC), BoardState::kFinished);
  EXPECT_EQ(state(0xEF), BoardState::kNoPower);
  EXPECT_EQ(state(0x00), std::nullopt);
  EXPECT_EQ(state(0x42), std::nullopt);
  EXPECT_EQ(parse_status("\xFF\xCE"), std::nullopt);
}

}  // namespace
}  // namespace veneer::lihuiyu
