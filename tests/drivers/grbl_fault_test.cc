// What happens when the wire or the controller fails in the middle of a job. One rule over all: a piece is reported
// verified only when exactly its strokes were burnt, with the power they were given; otherwise the job ends with the
// beam off.
#include <gmock/gmock.h>

#include <cstdio>
#include <ostream>
#include <span>
#include <string>

#include "tests/support/burn_check.h"
#include "tests/support/grbl_cell.h"

namespace veneer {
namespace {

using sim::Fault;
using sim::FaultKind;
using tests::GrblCell;
using tests::square_job;
using tests::wrong_burn;

// Runs a job with one fault, and looks at every verified piece at the moment it is reported.
class FaultedJob {
 public:
  explicit FaultedJob(int pieces) : job_(square_job(pieces, 6)) {
    cell.connect_and_home();
    cell.on_step = [this] {
      look();
      if (stop_off_the_path_ && !cell.over() && reported_off_the_path()) stop();
    };
  }

  // As an operator does who sees the head go astray, at once.
  void stop_off_the_path() { stop_off_the_path_ = true; }

  void with(const Fault& fault) {
    cell.bench.controller.inject(fault);
    cell.start(job_);
    cell.run_job();
    look();
  }

  // What must hold whatever went wrong.
  void expect_safe(const std::string& what) {
    SCOPED_TRACE(what);
    EXPECT_EQ(wrong, "");
    EXPECT_EQ(cell.all<laser_event::Done>().size() + cell.all<laser_event::Aborted>().size(), 1U);
    EXPECT_FALSE(cell.bench.controller.beam_on());
    const sim::BeamLog& log = cell.bench.controller.beam_log();
    EXPECT_EQ(log.beam_at_rest_s, 0);
    EXPECT_EQ(log.burnt_unhomed_mm, 0);
    EXPECT_LE(log.longest_queued_motion_s, 1.0);
    EXPECT_LE(cell.longest_queue_s, 1.0);
    if (const auto aborted = cell.first<laser_event::Aborted>()) {
      EXPECT_FALSE(aborted->error.message.empty());
      const bool burnt = cell.bench.burns.size() > counted_;
      EXPECT_EQ(aborted->suspect.size(), burnt || !aborted->suspect.empty() ? 1U : 0U) << "burnt but not suspect";
      for (const PieceId piece : aborted->suspect) EXPECT_EQ(piece.value, verified_ + 1);
    } else {
      EXPECT_EQ(verified_, static_cast<int>(job_.strokes.size()) / 3) << "done, but not with all pieces";
    }
  }

  // Whatever was burnt off the plan lies where the driver says that the beam may have strayed.
  void expect_strays_told(const std::string& what) {
    const auto aborted = cell.first<laser_event::Aborted>();
    if (!aborted) return;
    const std::vector<tests::Leg> planned = legs(false);
    std::vector<tests::Leg> told;
    for (std::size_t i = 1; i < aborted->stray_path.size(); ++i)
      told.push_back(leg(aborted->stray_path[i - 1], aborted->stray_path[i]));
    for (const sim::BurnSegment& burn : std::span(cell.bench.burns).subspan(counted_)) {
      const double x = burn.to.x_mm + 520, y = burn.to.y_mm + 380;
      const double off = nearest(planned, x, y);
      if (off < 0.06) continue;
      worst_stray = std::max(worst_stray, off);
      EXPECT_LE(nearest(told, x, y), aborted->stray_reach.count())
          << what << ": burnt at (" << x << ", " << y << "), " << off << " mm off the plan; " << aborted->error.message;
    }
  }

  Error abort_error() const {
    const auto aborted = cell.first<laser_event::Aborted>();
    return aborted ? aborted->error : Error{ErrorCode::kInternal, "not aborted"};
  }

  GrblCell cell;
  std::string wrong;
  double worst_stray = 0;  // mm off the plan

 private:
  static tests::Leg leg(const Point<MachineFrame>& a, const Point<MachineFrame>& b) {
    return {a.x.count(), a.y.count(), b.x.count(), b.y.count(), 0};
  }
  static double nearest(const std::vector<tests::Leg>& legs, double x, double y) {
    double least = 1e9;
    for (const tests::Leg& l : legs) {
      const double dx = l.bx - l.ax, dy = l.by - l.ay, square = dx * dx + dy * dy;
      const double t = square > 0 ? std::clamp(((x - l.ax) * dx + (y - l.ay) * dy) / square, 0.0, 1.0) : 0;
      least = std::min(least, std::hypot(x - l.ax - t * dx, y - l.ay - t * dy));
    }
    return least;
  }
  // Of all strokes; `with_ways`: and of the dark ways between them, from the corner on.
  std::vector<tests::Leg> legs(bool with_ways) const {
    std::vector<tests::Leg> all;
    Point<MachineFrame> at = point<MachineFrame>(519, 379);
    for (const Stroke& stroke : job_.strokes) {
      if (with_ways) all.push_back(leg(at, stroke.path.front()));
      for (std::size_t i = 1; i < stroke.path.size(); ++i) all.push_back(leg(stroke.path[i - 1], stroke.path[i]));
      at = stroke.path.back();
    }
    return all;
  }
  // The last report, as it came over the wire.
  bool reported_off_the_path() const {
    const auto found = cell.received.rfind("MPos:");
    double x = 0, y = 0;
    if (found == std::string::npos || std::sscanf(&cell.received[found], "MPos:%lf,%lf", &x, &y) != 2) return false;
    return nearest(legs(true), x + 520, y + 380) > 0.5;
  }
  void stop() {
    cell.core.abort(cell.now());
    cell.exchange();
  }
  void look() {
    for (; seen_ < cell.events.size(); ++seen_) {
      const auto* verified = std::get_if<laser_event::PieceVerified>(&cell.events[seen_]);
      if (verified == nullptr) continue;
      ++verified_;
      const auto burns = std::span(cell.bench.burns).subspan(counted_);
      const std::string problem = wrong_burn(job_, verified->piece, burns);
      if (!problem.empty() && wrong.empty()) wrong = "piece " + std::to_string(verified->piece.value) + ": " + problem;
      counted_ = cell.bench.burns.size();
    }
  }

  LaserJob job_;
  std::size_t seen_ = 0, counted_ = 0;
  int verified_ = 0;
  bool stop_off_the_path_ = false;
};

TEST(GrblFault, NoFaultBurnsEveryPieceRight) {
  FaultedJob run(5);
  run.cell.start(square_job(5, 6));
  run.cell.run_job();
  run.expect_safe("no fault");
  EXPECT_TRUE(run.cell.has<laser_event::Done>());
}

TEST(GrblFault, TheCheckItselfSeesWhatNoReportShows) {
  // The head slips without noticing: the controller's own position stays right, only the wood tells.
  FaultedJob run(3);
  run.with({FaultKind::kSlip, 60, 400});
  EXPECT_TRUE(run.cell.has<laser_event::Done>());
  EXPECT_NE(run.wrong, "");
}

struct Case {
  const char* name;
  Fault fault;
  const char* word;              // in the sentence the operator gets
  const char* remedy = nullptr;  // its end
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class GrblFaultCase : public ::testing::TestWithParam<Case> {};

TEST_P(GrblFaultCase, EndsTheJobWithBeamOffAndThePieceSuspect) {
  FaultedJob run(3);
  run.with(GetParam().fault);
  run.expect_safe(GetParam().name);
  run.expect_strays_told(GetParam().name);
  ASSERT_TRUE(run.cell.has<laser_event::Aborted>());
  EXPECT_THAT(run.abort_error().message, ::testing::HasSubstr(GetParam().word));
  // The sentence ends with what to do, except where the machine said itself what it is.
  if (GetParam().remedy != nullptr) {
    EXPECT_THAT(run.abort_error().message, ::testing::HasSubstr(GetParam().remedy));
  }
  EXPECT_THAT(run.cell.first<laser_event::Aborted>()->suspect, ::testing::SizeIs(1));
}

INSTANTIATE_TEST_SUITE_P(
    Faults, GrblFaultCase,
    ::testing::Values(Case{"LostOk", {FaultKind::kDropOk, 40}, "answers were lost", ": check the cable"},
                      Case{"ExtraOk", {FaultKind::kDuplicateOk, 40}, "answers do not match"},
                      Case{"Unplugged", {FaultKind::kUnplug, 1000}, "link"},
                      Case{"ResetByItself", {FaultKind::kBanner, 40}, "was reset", ": check its power"},
                      Case{"RefusedLine", {FaultKind::kError, 40, 22}, "error:22 of Grbl (no feed rate given)"},
                      Case{"LimitSwitch", {FaultKind::kAlarm, 40, 1}, "ALARM:1 of Grbl (a limit switch was hit)"},
                      Case{"Stall",
                           {FaultKind::kStall, 40},
                           "this computer was too loaded to hear it",
                           ": check its cable and supply, end other heavy programs"}),
    [](const auto& test) { return test.param.name; });

TEST(GrblFault, ADigitLostFromAMoveIsFoundByThePosition) {
  // Somewhere in the second piece a digit goes missing and leaves a valid line.
  int found = 0;
  double worst_stray = 0;
  for (std::uint64_t after = 700; after < 1100; ++after) {
    FaultedJob run(2);
    run.with({FaultKind::kDropByte, after});
    run.expect_safe("byte " + std::to_string(after));
    run.expect_strays_told("byte " + std::to_string(after));
    worst_stray = std::max(worst_stray, run.worst_stray);
    found += run.abort_error().message.find("off its path") != std::string::npos ||
                     run.abort_error().message.find("from where the piece ends") != std::string::npos
                 ? 1
                 : 0;
  }
  EXPECT_GT(found, 5);
  EXPECT_GT(worst_stray, 0.3) << "nothing was burnt off the plan: this proves nothing";
}

TEST(GrblFault, AStopBehindOneReportOffThePathTellsWhereTheBeamStrayed) {
  int stopped = 0;
  for (std::uint64_t after = 700; after < 1100; after += 3) {
    FaultedJob run(2);
    run.stop_off_the_path();
    run.with({FaultKind::kDropByte, after});
    run.expect_strays_told("byte " + std::to_string(after));
    if (run.abort_error().code != ErrorCode::kCancelled) continue;
    ++stopped;
    EXPECT_FALSE(run.cell.first<laser_event::Aborted>()->stray_path.empty()) << "byte " << after;
  }
  EXPECT_GT(stopped, 5) << "nothing strayed: this proves nothing";
}

TEST(GrblFault, ALidOpenedOverACutLeavesAGapSoThePieceIsFinishedButSuspect) {
  FaultedJob run(2);
  run.cell.start(square_job(2, 6));
  run.cell.run(100, [&] { return run.cell.bench.controller.beam_on(); });
  run.cell.bench.controller.set_lid(true, run.cell.now());
  run.cell.run(5);
  EXPECT_TRUE(run.cell.has<laser_event::Held>());
  EXPECT_FALSE(run.cell.bench.controller.beam_on());
  EXPECT_FALSE(run.cell.over());

  const auto held = run.cell.all<laser_event::Held>().size();
  run.cell.core.resume(run.cell.now());
  run.cell.exchange();
  run.cell.run(2);
  EXPECT_EQ(run.cell.all<laser_event::Held>().size(), held + 1) << "still held: the lid is open";
  EXPECT_FALSE(run.cell.bench.controller.moving());

  run.cell.bench.controller.set_lid(false, run.cell.now());
  run.cell.run(5);
  EXPECT_FALSE(run.cell.bench.controller.moving()) << "closing the lid moves nothing";
  run.cell.core.resume(run.cell.now());
  run.cell.exchange();
  run.cell.run_job();
  run.expect_safe("lid");
  EXPECT_TRUE(run.cell.has<laser_event::Resumed>());
  ASSERT_TRUE(run.cell.has<laser_event::Aborted>());
  EXPECT_THAT(run.abort_error().message,
              ::testing::AllOf(::testing::HasSubstr("the lid was opened while the beam was on"),
                               ::testing::HasSubstr("say whether it is cut (veneerctl job settle)"),
                               ::testing::HasSubstr("Clear, Reset and Start")));
  EXPECT_THAT(run.cell.first<laser_event::Aborted>()->suspect, ::testing::ElementsAre(PieceId{1}));
  EXPECT_FALSE(run.cell.first<laser_event::Aborted>()->position_lost);
  EXPECT_GT(run.cell.bench.burnt_mm(), 34 * 0.9) << "it was finished all the same";
}

TEST(GrblFault, ALidOpenedOnTheDarkWayCostsNothing) {
  FaultedJob run(1);
  run.cell.start(square_job(1, 6));
  run.cell.run(100, [&] { return run.cell.bench.controller.moving(); });
  run.cell.run(0.3);
  run.cell.bench.controller.set_lid(true, run.cell.now());
  run.cell.run(3);
  ASSERT_TRUE(run.cell.has<laser_event::Held>());
  run.cell.bench.controller.set_lid(false, run.cell.now());
  run.cell.run(1);
  run.cell.core.resume(run.cell.now());
  run.cell.exchange();
  run.cell.run_job();
  run.expect_safe("lid");
  EXPECT_TRUE(run.cell.has<laser_event::Done>());
}

TEST(GrblFault, AfterAnAbortNothingMovesUntilHomedAgain) {
  FaultedJob run(3);
  run.with({FaultKind::kAlarm, 15, 1});
  ASSERT_TRUE(run.cell.has<laser_event::Aborted>());
  run.cell.bench.controller.set_consent(false);
  run.cell.events.clear();
  run.cell.run(20);
  run.cell.start(square_job(1));
  run.cell.run(5);
  ASSERT_TRUE(run.cell.has<laser_event::Failed>());
  EXPECT_EQ(run.cell.first<laser_event::Failed>()->error.code, ErrorCode::kRefused);
  EXPECT_EQ(run.cell.bench.controller.beam_log().moved_without_consent_mm, 0);

  run.cell.bench.controller.set_consent(true);
  run.cell.events.clear();
  run.cell.core.home(run.cell.now());
  run.cell.exchange();
  run.cell.run(120, [&] { return run.cell.has<laser_event::Homed>(); });
  ASSERT_TRUE(run.cell.has<laser_event::Homed>());
  run.cell.start(square_job(1));
  run.cell.run_job();
  EXPECT_TRUE(run.cell.has<laser_event::Done>());
}

}  // namespace
}  // namespace veneer
