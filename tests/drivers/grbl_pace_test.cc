// A line that arrives changed may run for minutes: with another feed, or to another place. The controller tells nothing
// of it, so the driver holds the machine against the pace and the path it was told.
#include <gmock/gmock.h>

#include <string>

#include "tests/support/grbl_cell.h"

namespace veneer {
namespace {

using tests::GrblCell;
using tests::square_job;

// A job of one piece in which the `count`-th occurrence of `line` arrives as `changed`.
class ChangedLine {
 public:
  ChangedLine(const std::string& line, const std::string& changed, int count = 1) {
    cell.connect_and_home();
    cell.on_wire = [line = line + "\n", changed = changed + "\n", count](std::string& bytes) mutable {
      for (auto at = bytes.find(line); count > 0 && at != std::string::npos; at = bytes.find(line, at + 1)) {
        if ((at > 0 && bytes[at - 1] != '\n') || --count > 0) continue;
        bytes.replace(at, line.size(), changed);
      }
    };
    cell.start(square_job(1, 6));
    cell.run_job();
  }
  std::string sentence() const {
    const auto aborted = cell.first<laser_event::Aborted>();
    return aborted ? aborted->error.message : "not aborted";
  }

  GrblCell cell;
};

TEST(GrblPace, AFeedThatLostItsSizeIsNoticedBeforeTheBeamHasStoodForTwoSeconds) {
  ChangedLine run("X-2", "F2", 1);  // 2 mm/min from there on, at full power
  EXPECT_THAT(run.sentence(), ::testing::HasSubstr("later than its settings allow"));
  ASSERT_TRUE(run.cell.has<laser_event::Aborted>());
  EXPECT_THAT(run.cell.first<laser_event::Aborted>()->suspect, ::testing::ElementsAre(PieceId{1}));
  double crept_s = 0;
  for (const sim::BurnSegment& burn : run.cell.bench.burns)
    if (burn.length_mm() < 0.1) crept_s += std::chrono::duration<double>(burn.end - burn.start).count();
  EXPECT_LT(crept_s, 2.0);
  EXPECT_GT(crept_s, 0.1) << "the beam must have crept for this test to say anything";
}

TEST(GrblPace, ALineThatGrewIsNoticedWithinASecondOfMotion) {
  ChangedLine run("Y-2", "Y-7", 1);
  EXPECT_THAT(run.sentence(), ::testing::HasSubstr("off its path"));
  EXPECT_LE(run.cell.bench.controller.beam_log().longest_queued_motion_s, 1.0);
}

TEST(GrblPace, AnArcThatNoiseTurnedTheOtherWayIsNoticed) {
  ChangedLine run("X1.365Y-0.788I0.752J-0.274", "X1.365Y-0.788I0.75G2J-0.274");
  EXPECT_THAT(run.sentence(),
              ::testing::AnyOf(::testing::HasSubstr("understood"), ::testing::HasSubstr("off its path")));
  EXPECT_FALSE(run.cell.has<laser_event::PieceVerified>());
}

// Its line is answered when its last chord is planned, so nothing else says that it was understood at all.
TEST(GrblPace, AnArcWhoseFeedNoiseChangedIsNoticedBeforeTheBeamHasStoodForTwoSeconds) {
  ChangedLine run("G3X-1.552Y0.274I-0.8S200", "G3X-1.552Y0.274I-0.8F5S200");
  EXPECT_THAT(run.sentence(), ::testing::HasSubstr("later than its settings allow"));
  ASSERT_TRUE(run.cell.has<laser_event::Aborted>());
  EXPECT_THAT(run.cell.first<laser_event::Aborted>()->suspect, ::testing::ElementsAre(PieceId{1}));
  double crept_s = 0;
  for (const sim::BurnSegment& burn : run.cell.bench.burns) {
    const double seconds = std::chrono::duration<double>(burn.end - burn.start).count();
    if (burn.length_mm() / seconds < 1) crept_s += seconds;
  }
  EXPECT_LT(crept_s, 2.0);
  EXPECT_GT(crept_s, 0.1) << "the beam must have crept for this test to say anything";
}

TEST(GrblPace, AMachineHeldForLongIsNotLate) {
  GrblCell cell;
  cell.connect_and_home();
  cell.start(square_job(1, 6));
  cell.run(100, [&] { return cell.bench.controller.beam_on(); });
  cell.run(0.3);
  cell.core.hold(cell.now());
  cell.exchange();
  cell.run(60, [&] { return cell.has<laser_event::Held>(); });
  cell.run(60);
  cell.core.resume(cell.now());
  cell.exchange();
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
}

TEST(GrblPace, AMachineSlowedByItsOverrideIsNotLate) {
  GrblCell cell;
  cell.connect_and_home();
  ASSERT_TRUE(cell.core.set_overrides({.feed = 25}, cell.now()).ok());
  cell.exchange();
  cell.run(10);
  cell.start(square_job(2, 6));
  cell.run(100, [&] { return cell.bench.controller.beam_on(); });
  ASSERT_TRUE(cell.core.set_overrides({.feed = 100}, cell.now()).ok());
  cell.exchange();
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
}

}  // namespace
}  // namespace veneer
