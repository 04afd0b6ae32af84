#include "daemon/unit/preflight.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;

Point<MachineFrame> at(double x, double y) { return point<MachineFrame>(x, y); }

Box<MachineFrame> box(double x0, double y0, double x1, double y1) {
  Box<MachineFrame> b;
  b.add(at(x0, y0));
  b.add(at(x1, y1));
  return b;
}

PieceBurn burn(const std::string& mark, std::vector<Point<MachineFrame>> path) {
  Stroke stroke;
  stroke.path = std::move(path);
  stroke.speed = MmPerSecond(15);
  stroke.power = PowerFraction(0.85);
  return {PieceId{1}, mark, LaserJob{{stroke}}, 1};
}

class PreflightTest : public ::testing::Test {
 protected:
  LaserLimits limits_{box(0, 0, 500, 300), "Grbl 1.1h", true, MmPerSecond(200)};
  std::vector<KeepOut> zones_;
  std::string refusal(const std::vector<PieceBurn>& burns) {
    const Status checked = check_strokes(burns, limits_, zones_, at(0, 0));
    return checked ? "" : checked.error().message;
  }
};

TEST_F(PreflightTest, AJobInsideTheTravelIsTaken) { EXPECT_EQ(refusal({burn("A1", {at(10, 10), at(490, 290)})}), ""); }

TEST_F(PreflightTest, SaysWhichPieceLeavesTheTravelByHowMuchAndWhereToMoveThePanel) {
  EXPECT_THAT(refusal({burn("A1", {at(10, 10), at(20, 10)}), burn("B2", {at(10, 10), at(512.5, 20)})}),
              AllOf(HasSubstr("piece B2"), HasSubstr("12.5 mm at the right side"), HasSubstr("to the left")));
  EXPECT_THAT(refusal({burn("A1", {at(10, 10), at(-3, 20)})}), HasSubstr("3.0 mm at the left side"));
  EXPECT_THAT(refusal({burn("A1", {at(10, 10), at(10, -1)})}), HasSubstr("1.0 mm at the front"));
  EXPECT_THAT(refusal({burn("A1", {at(10, 10), at(10, 302)})}), HasSubstr("2.0 mm at the back"));
}

TEST_F(PreflightTest, TheRunUpOfAFillCountsAsItsWay) {
  auto fill = burn("A1", {at(5, 10), at(490, 10)});
  EXPECT_EQ(refusal({fill}), "");
  fill.strokes.strokes[0].overscan = Millimetres(8);
  EXPECT_THAT(refusal({fill}), HasSubstr("3.0 mm at the left side"));
}

TEST_F(PreflightTest, AHeadThatStandsInAZoneLeavesItByTheNearerSide) {
  const auto refused = [&](Point<MachineFrame> from, double dx, double dy) {
    const Status checked = check_jog(zones_, limits_.travel, from, Millimetres(dx), Millimetres(dy));
    return checked ? std::string() : checked.error().message;
  };
  zones_ = {{"clamp", box(200, 100, 240, 140)}};
  EXPECT_EQ(refused(at(205, 120), -20, 0), "");
  EXPECT_EQ(refused(at(205, 120), -2, 0), "") << "on its way out";
  EXPECT_EQ(refused(at(205, 135), -20, 20), "");
  EXPECT_EQ(refused(at(205, 120), 60, 0), "the head stands in the zone \"clamp\": leave it by the nearer side");
  EXPECT_NE(refused(at(205, 135), -20, -60), "") << "through its middle on one axis";
  // At the travel's corner there is one way out of each axis, however far it is.
  zones_ = {{"camera's foot", box(0, -5, 80, 60)}};
  EXPECT_EQ(refused(at(5, 3), 100, 0), "");
  EXPECT_EQ(refused(at(5, 3), 0, 80), "");
  EXPECT_NE(refused(at(5, 3), -4, 0), "");
}

// There is a way straight out wherever there is one, and a sentence where there is none.
TEST_F(PreflightTest, ZonesThatLieOneOverAnotherAreLeftAsOne) {
  const auto refused = [&](Point<MachineFrame> from, double dx, double dy) {
    const Status checked = check_jog(zones_, limits_.travel, from, Millimetres(dx), Millimetres(dy));
    return checked ? std::string() : checked.error().message;
  };
  // Each has its nearer sides where the other has its farther ones.
  zones_ = {{"clamp", box(200, 100, 240, 140)}, {"lamp", box(180, 80, 210, 110)}};
  EXPECT_EQ(refused(at(204, 106), -30, 0), "");
  EXPECT_EQ(refused(at(204, 106), 0, -30), "");
  EXPECT_NE(refused(at(204, 106), 40, 0), "") << "that is farther";
  // The nearer sides lie behind other zones, which the head does not stand in.
  zones_ = {{"clamp", box(200, 100, 240, 140)}, {"lamp", box(190, 90, 203, 150)}, {"pipe", box(190, 80, 250, 102)}};
  EXPECT_THAT(refused(at(206, 104), -20, 0), HasSubstr("\"lamp\" lies in that way"));
  EXPECT_EQ(refused(at(206, 104), 40, 0), "");
  EXPECT_EQ(refused(at(206, 104), 0, 40), "");
  // Over all of the bed.
  zones_ = {{"rail", box(-9, -9, 60, 400)}, {"lid", box(-9, -9, 900, 400)}};
  EXPECT_THAT(refused(at(30, 22), 5, 0), HasSubstr("move its head by hand"));
}

// Two legs: past the edge of what is in the way, then out.
TEST_F(PreflightTest, AHeadThatNothingLeadsStraightOutOfIsToldTheFirstLeg) {
  const auto refused = [&](Point<MachineFrame> from, double dx, double dy) {
    const Status checked = check_jog(zones_, limits_.travel, from, Millimetres(dx), Millimetres(dy));
    return checked ? std::string() : checked.error().message;
  };
  // The head stands in all three; beside the rail only the two that lie across it are left.
  zones_ = {{"rail", box(-9, -9, 60, 400)}, {"foot", box(-9, 20, 900, 60)}, {"door", box(-9, -9, 900, 25)}};
  EXPECT_EQ(refused(at(30, 22), 0, 5),
            "the head stands in the zone \"rail\", and nothing leads straight out: jog it 30.5 mm to the right first, "
            "and out of the zone from there");
  EXPECT_EQ(refused(at(30, 22), 30.5, 0), "");
  EXPECT_EQ(refused(at(30, 22), 10, 0), "") << "the beginning of it";
  EXPECT_EQ(refused(at(30, 22), 40, 0), "") << "in steps of ten it is met nowhere";
  EXPECT_EQ(refused(at(30, 22), 40.5, 0), "");
  EXPECT_NE(refused(at(30, 22), 41, 0), "");
  EXPECT_NE(refused(at(30, 22), 400, 0), "") << "370 mm inside the foot and the door";
  EXPECT_NE(refused(at(60.5, 22), 400, 0), "") << "and no more from the leg's end";
  EXPECT_NE(refused(at(30, 22), -10, 0), "");
  EXPECT_NE(refused(at(30, 22), 10, 5), "");
  EXPECT_EQ(refused(at(40, 22), 30, 0), "") << "from where ten have led";
  EXPECT_EQ(refused(at(60.5, 22), 0, 40), "") << "and out";
  // Four others around the one it stands in, with a gap at one corner.
  zones_ = {{"clamp", box(200, 100, 240, 140)},
            {"left", box(190, 90, 201, 160)},
            {"right", box(239, 90, 250, 160)},
            {"front", box(190, 80, 250, 101)},
            {"back", box(190, 139, 232, 150)}};
  EXPECT_THAT(refused(at(210, 120), 0, 30), HasSubstr("\"back\" lies in that way"));
  EXPECT_THAT(refused(at(210, 120), 0, 5), HasSubstr("jog it 22.5 mm to the right first"));
  EXPECT_EQ(refused(at(210, 120), 22.5, 0), "");
  EXPECT_EQ(refused(at(232.5, 120), 0, 40), "");
  // Without the gap.
  zones_.back().area.max.x = Millimetres(250);
  EXPECT_THAT(refused(at(210, 120), 22.5, 0), HasSubstr("move its head by hand"));
}

TEST_F(PreflightTest, NeitherACutNorADarkWayMayCrossAZone) {
  zones_ = {{"clamp", box(200, 100, 240, 140)}};
  EXPECT_EQ(refusal({burn("A1", {at(10, 10), at(190, 10)}), burn("A2", {at(190, 290), at(10, 290)})}), "");
  EXPECT_THAT(refusal({burn("A1", {at(10, 120), at(490, 120)})}), HasSubstr("\"clamp\""));
  // Two harmless cuts with the clamp between them.
  EXPECT_THAT(refusal({burn("A1", {at(10, 120), at(100, 120)}), burn("A2", {at(400, 120), at(490, 120)})}),
              AllOf(HasSubstr("piece A2"), HasSubstr("\"clamp\"")));
  // The way from where the head stands.
  EXPECT_THAT(refusal({burn("A1", {at(440, 240), at(450, 240)})}), HasSubstr("\"clamp\""));
}

// A Lihuiyu board goes to its first stroke in x, then in y, and on from there diagonally, then straight.
TEST_F(PreflightTest, ADarkWayWithinABoxMayTouchWhateverIsInIt) {
  zones_ = {{"clamp", box(200, 10, 240, 40)}};
  const auto first = burn("A1", {at(400, 200), at(410, 200)});  // from 0, 0
  EXPECT_EQ(refusal({first}), "") << "straight there it lies aside";
  limits_.dark_ways = DarkWays::kWithinBox;
  EXPECT_THAT(refusal({first}), HasSubstr("\"clamp\""));
  EXPECT_EQ(refusal({burn("A1", {at(190, 200), at(490, 200)})}), "") << "a cut goes as it is drawn";
  // Between two passes it goes back, which a closed outline does not need.
  zones_ = {{"clamp", box(200, 50, 240, 90)}};
  auto bow = burn("A1", {at(100, 50), at(100, 150), at(400, 150), at(400, 60)});
  EXPECT_EQ(refusal({bow}), "");
  bow.strokes.strokes[0].passes = 2;
  EXPECT_THAT(refusal({bow}), HasSubstr("\"clamp\""));
  limits_.dark_ways = DarkWays::kStraight;
  EXPECT_EQ(refusal({bow}), "") << "back along the bow itself";
}

TEST_F(PreflightTest, AnOpenStrokeOfTwoPassesEndsWhereItBegan) {
  zones_ = {{"clamp", box(200, 100, 240, 140)}};
  auto there_and_back = burn("A1", {at(10, 290), at(490, 290)});
  const auto next = burn("A2", {at(10, 10), at(20, 10)});
  EXPECT_THAT(refusal({there_and_back, next}), HasSubstr("\"clamp\""));
  there_and_back.strokes.strokes[0].passes = 2;
  EXPECT_EQ(refusal({there_and_back, next}), "");
  const auto far = burn("A2", {at(400, 10), at(390, 10)});
  EXPECT_THAT(refusal({there_and_back, far}), HasSubstr("\"clamp\""));
}

TEST_F(PreflightTest, ARecipeNobodyCouldBurnIsRefused) {
  auto fast = burn("A1", {at(10, 10), at(20, 10)});
  fast.strokes.strokes[0].speed = MmPerSecond(300);
  EXPECT_THAT(refusal({fast}), AllOf(HasSubstr("300 mm/s"), HasSubstr("200")));
  auto strong = burn("A1", {at(10, 10), at(20, 10)});
  strong.strokes.strokes[0].power = PowerFraction(1.2);
  EXPECT_THAT(refusal({strong}), HasSubstr("recipe"));
  auto endless = burn("A1", {at(10, 10), at(20, 10)});
  endless.strokes.strokes[0].passes = 0;
  EXPECT_THAT(refusal({endless}), HasSubstr("recipe"));
  EXPECT_THAT(refusal({burn("A1", {at(10, 10), at(std::nan(""), 10)})}), HasSubstr("cannot be computed"));
  EXPECT_THAT(refusal({}), HasSubstr("nothing to burn"));
}

TEST_F(PreflightTest, TheMachineMustBeThereHomedAndClosed) {
  LaserStatus laser;
  laser.connected = laser.homed = true, laser.state = "Idle", laser.firmware = "Grbl 1.1h";
  EXPECT_TRUE(check_machine(laser).ok());
  laser.state = "Door:1";
  EXPECT_THAT(check_machine(laser).error().message, HasSubstr("lid is open"));
  EXPECT_TRUE(lid_is_open(laser));
  // It is closed again, and the controller takes seconds to come out of its wait.
  laser.state = "Door:3", laser.lid_open = false;
  EXPECT_FALSE(lid_is_open(laser));
  for (const Status& refused : {check_machine(laser), check_before_homing(laser)})
    EXPECT_EQ(refused.error().message,
              "the lid is closed again, and the controller is still coming out of its wait: wait a few seconds");
  laser.state = "Door:0";
  EXPECT_TRUE(check_machine(laser).ok());
  laser.state = "Alarm";
  EXPECT_THAT(check_machine(laser).error().message, HasSubstr("alarm"));
  laser.state = "Idle", laser.homed = false;
  EXPECT_THAT(check_machine(laser).error().message, HasSubstr("Reset"));
  laser.connected = false;
  EXPECT_THAT(check_machine(laser).error().message, HasSubstr("not connected"));
}

TEST_F(PreflightTest, TheFrameIsTheHullOfAllStrokes) {
  const std::vector<PieceBurn> burns{burn("A1", {at(10, 10), at(30, 10), at(20, 20)}),
                                     burn("A2", {at(30, 30), at(10, 30), at(15, 15)})};
  const LaserJob frame = frame_of(burns, MmPerSecond(100), PowerFraction(0));
  ASSERT_THAT(frame.strokes, SizeIs(1));
  const auto& path = frame.strokes[0].path;
  EXPECT_EQ(path, (std::vector{at(10, 10), at(30, 10), at(30, 30), at(10, 30), at(10, 10)}));
  EXPECT_EQ(frame.strokes[0].power.count(), 0);
  EXPECT_EQ(frame.strokes[0].piece.value, 0);
  EXPECT_TRUE(frame_of({}, MmPerSecond(100), PowerFraction(0)).strokes.empty());
}

RC_GTEST_PROP(Preflight, TheHullHoldsEveryPointAndTurnsLeft, ()) {
  const auto raw = *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(0, 40), rc::gen::inRange(0, 40))));
  std::vector<Point<MachineFrame>> points;
  for (const auto& [x, y] : raw) points.push_back(at(x, y));
  const auto hull = convex_hull(points);
  RC_PRE(hull.size() >= 3);
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const auto &a = hull[i], &b = hull[(i + 1) % hull.size()];
    for (const auto& p : points)
      RC_ASSERT((b.x - a.x).count() * (p.y - a.y).count() - (b.y - a.y).count() * (p.x - a.x).count() >= 0);
  }
}

RC_GTEST_PROP(Preflight, AWayCrossesABoxWhenAPointOfItLiesInside, (int x0, int y0, int x1, int y1)) {
  const auto small = [](int v) { return std::abs(v % 60) * 1.0; };
  const auto a = at(small(x0), small(y0)), b = at(small(x1), small(y1));
  const auto zone = box(20, 20, 40, 40);
  bool inside = false;
  for (int i = 0; i <= 2000; ++i)
    inside = inside || zone.contains({a.x + (b.x - a.x) * (i / 2000.0), a.y + (b.y - a.y) * (i / 2000.0)});
  if (inside) RC_ASSERT(crosses(zone, a, b));
  const auto grown = box(19.9, 19.9, 40.1, 40.1);
  if (crosses(zone, a, b)) {
    bool near = false;
    for (int i = 0; i <= 2000; ++i)
      near = near || grown.contains({a.x + (b.x - a.x) * (i / 2000.0), a.y + (b.y - a.y) * (i / 2000.0)});
    RC_ASSERT(near);
  }
}

TEST(Preflight, AHeadStandsStillUnlessTheMachineSaysOtherwise) {
  LaserStatus laser;
  EXPECT_TRUE(stands_still(laser)) << "nobody is there";
  laser.connected = true;
  for (const char* rests : {"Idle", "Alarm", "Sleep", "Door:0", "Door:1", "Check", "Ready", "Finished"}) {
    laser.state = rests;
    EXPECT_TRUE(stands_still(laser)) << rests;
  }
  for (const char* moves : {"Run", "Jog", "Home", "Hold:0", "Hold:1", "Door:2", "Door:3", "Held"}) {
    laser.state = moves;
    EXPECT_FALSE(stands_still(laser)) << moves;
  }
}

}  // namespace
}  // namespace veneer::daemon
