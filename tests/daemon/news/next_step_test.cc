// From an unpacked machine to the last piece, one sentence after the other.
#include "daemon/news/next_step.h"

#include <gmock/gmock.h>

#include <set>

#include "calib/camera_fit.h"

namespace veneer::daemon {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::vector<CellNeeds::Certificate> certificates(CertificateState state) {
  return {{db::CertificateKind::kScanner, state},
          {db::CertificateKind::kCamera, state},
          {db::CertificateKind::kAxes, state},
          {db::CertificateKind::kKerf, state}};
}

// Calibrated, with two panels in stock.
CellNeeds ready() {
  CellNeeds needs;
  needs.certificates = certificates(CertificateState::kValid);
  needs.panels = 2;
  return needs;
}

CellView in(CellState state) {
  CellView view;
  view.state = state;
  return view;
}

CellView waiting_for(const char* panel, bool found) {
  CellView view = in(CellState::kSuspended);
  view.load.emplace();
  view.load->panel = PanelId{panel};
  view.load->found = found;
  return view;
}

TEST(NextStep, AnUnpackedMachineIsCalibratedDeviceByDevice) {
  CellNeeds needs;
  needs.certificates = certificates(CertificateState::kMissing);
  const CellView stopped = in(CellState::kStopped);
  std::vector<std::string> commands;
  for (CellNeeds::Certificate& certificate : needs.certificates) {
    commands.push_back(next_step(stopped, needs).command);
    certificate.state = CertificateState::kValid;
  }
  EXPECT_THAT(commands,
              ::testing::ElementsAre("veneerctl calibrate scanner", "veneerctl calibrate camera --height-mm 0 --more",
                                     "veneerctl calibrate laser --board-width-mm WIDTH --board-height-mm HEIGHT",
                                     "veneerctl calibrate kerf"));
  EXPECT_EQ(next_step(stopped, needs).step, Step::kScan);
  EXPECT_EQ(next_step(stopped, needs).sentence,
            "There is no wood in stock: lay a panel on the scanner, show face on the glass, and scan it.");
}

TEST(NextStep, TheCamerasViewsThatAreTakenCount) {
  CellNeeds needs = ready();
  needs.certificates[1].state = CertificateState::kMissing;
  const auto after = [&](std::vector<double> heights) {
    needs.camera_views.clear();
    for (const double height : heights) needs.camera_views.emplace_back(height);
    return next_step(in(CellState::kStopped), needs);
  };
  EXPECT_THAT(after({}).sentence, HasSubstr("with four views at two heights"));
  EXPECT_EQ(after({0}).sentence,
            "The camera is not calibrated yet, and 1 of the 4 views is taken, none of them at another height: lay the "
            "printed grid elsewhere on the bed, turned a little, and take the next one.");
  EXPECT_EQ(after({0}).command, "veneerctl calibrate camera --height-mm 0 --more");
  EXPECT_EQ(after({0, 0}).sentence,
            "The camera is not calibrated yet, and 2 of the 4 views are taken, none of them at another height: lay the "
            "printed grid on blocks of one height, and take the next one.");
  EXPECT_EQ(after({0, 0}).command, "veneerctl calibrate camera --height-mm HEIGHT --more");
  EXPECT_EQ(after({0, 0, 30}).sentence,
            "The camera is not calibrated yet, and 3 of the 4 views are taken: lay the printed grid elsewhere on its "
            "blocks, turned a little, and take the last one.");
  EXPECT_EQ(after({0, 0, 30}).command, "veneerctl calibrate camera --height-mm 30");
  EXPECT_THAT(after({0, 30}).sentence, HasSubstr("lay the printed grid flat on the bed, and take the next"));
  EXPECT_EQ(after({0, 30}).command, "veneerctl calibrate camera --height-mm 0 --more");
  EXPECT_THAT(after({30}).sentence, HasSubstr("none of them flat on the bed: lay the printed grid flat on the bed"));
  EXPECT_THAT(after({30, 0}).sentence, HasSubstr("lay the printed grid elsewhere on the bed, turned a little"))
      << "it lies flat already";
  EXPECT_THAT(after({30, 30, 30}).command, ::testing::EndsWith("--height-mm 0")) << "the last that the fit wants";
  EXPECT_THAT(after({0, 0, 0}).command, ::testing::EndsWith("--height-mm HEIGHT"));
  EXPECT_THAT(after({0, 0, 30, 30, 30}).sentence, HasSubstr("5 views are taken: lay the printed grid"))
      << "only the one that ends it is missing";
  // The range of heights decides, as in the fit.
  const double range = calib::CameraFitLimits().min_height_range.count();
  EXPECT_THAT(after({0, 0, 0.7 * range}).sentence,
              HasSubstr("all within 5 mm of height: lay the printed grid on block"));
  EXPECT_THAT(after({0.7 * range, 1.3 * range, 1.3 * range}).sentence, HasSubstr("all within 5 mm of height"));
  EXPECT_THAT(
      after({2 * range, 4 * range, 4 * range}).sentence,
      HasSubstr("3 of the 4 views are taken: lay the printed grid elsewhere on its blocks, turned a little, and "
                "take the last one"));
}

TEST(NextStep, ACertificateThatNoLongerHoldsSaysWhy) {
  CellNeeds needs = ready();
  needs.certificates[2].state = CertificateState::kReplaced;
  EXPECT_THAT(next_step(in(CellState::kIdle), needs).sentence,
              StartsWith("The laser must be calibrated anew, because the camera was: "));
  needs.certificates[0].state = CertificateState::kExpired;
  EXPECT_THAT(next_step(in(CellState::kIdle), needs).sentence, StartsWith("The scanner was calibrated too long ago: "))
      << "the first that stands in the way";
}

// Of these no panel is laid and none looked at, and nobody says Unsuspend.
TEST(NextStep, APatternBurnsByItselfOnceItBegins) {
  const auto alone = [](CellState state) {
    CellView view = in(state);
    view.alone = true;
    return next_step(view, ready()).sentence;
  };
  for (const CellState state : {CellState::kStarting, CellState::kUnholding}) {
    EXPECT_THAT(alone(state), HasSubstr("keep your hands out")) << to_string(state);
    EXPECT_THAT(alone(state), Not(HasSubstr("panel"))) << to_string(state);
  }
  EXPECT_EQ(alone(CellState::kHeld), "The laser is held: when nothing is in the way, Unhold goes on where it stopped.");
}

TEST(NextStep, FromWoodToThePictureAndItsJob) {
  CellNeeds needs = ready();
  const CellView stopped = in(CellState::kStopped);
  EXPECT_EQ(next_step(stopped, needs).step, Step::kPlan);
  needs.plan = {3, "portrait", 16};
  EXPECT_EQ(next_step(stopped, needs).command, "veneerctl job new --plan 3");
  needs.job = {1, "portrait", 16};
  EXPECT_EQ(next_step(stopped, needs).sentence,
            "Job 1 “portrait” has 16 pieces to cut: Reset homes the laser first, so keep your hands off the machine.");
  EXPECT_EQ(next_step(in(CellState::kIdle), needs).command, "veneerctl job start 1");
  needs.to_scan = {PanelId{"P-0001"}, PanelId{"P-0002"}, PanelId{"P-0004"}};
  EXPECT_THAT(next_step(stopped, needs).sentence, StartsWith("Panel P-0001 waits for a scan, and so do 2 more: "));
  needs.proposal = db::ProposalId{3};
  EXPECT_EQ(next_step(stopped, needs).step, Step::kAccept);
  EXPECT_EQ(next_step(stopped, needs).command, "veneerctl panel proposals 3");
}

TEST(NextStep, WhileAPanelIsWaitedForItIsNamed) {
  EXPECT_EQ(next_step(waiting_for("P-0041", false), ready()).sentence,
            "Lay panel P-0041 on the bed, face down: the camera finds it there.");
  CellView second = waiting_for("P-0041", false);
  second.load->setup.how = "turned by 180 degrees";
  EXPECT_THAT(next_step(second, ready()).sentence, HasSubstr("on the bed, turned by 180 degrees:"));
  const NextStep found = next_step(waiting_for("P-0041", true), ready());
  EXPECT_EQ(found.step, Step::kConfirm);
  EXPECT_EQ(found.command, "veneerctl unsuspend");
  CellNeeds needs = ready();
  needs.confirm = {"exhaust"};
  EXPECT_THAT(next_step(waiting_for("P-0041", true), needs).sentence, HasSubstr("tick what you have seen to"));
}

// "Nothing to load" is not what an operator wants to read then, and neither is what else the cell needs.
TEST(NextStep, WhileTheLaserIsAtWorkNothingElseIsAskedFor) {
  CellNeeds needs;  // no certificate holds any more
  needs.to_scan = {PanelId{"P-0009"}};
  needs.device_seconds_per_second = 10;
  CellView view = in(CellState::kExecute);
  view.job.emplace();
  view.job->current_piece = "A3-12";
  view.job->eta_seconds = 3000;
  EXPECT_EQ(next_step(view, needs).sentence, "Piece A3-12 is being cut, about 5 min left: stay beside the machine.");
  for (const CellState state : {CellState::kResetting, CellState::kStarting, CellState::kHolding, CellState::kUnholding,
                                CellState::kSuspending, CellState::kUnsuspending, CellState::kCompleting,
                                CellState::kStopping, CellState::kAborting, CellState::kClearing}) {
    const NextStep step = next_step(in(state), needs);
    EXPECT_EQ(step.step, Step::kWait) << to_string(state);
    EXPECT_THAT(step.sentence, EndsWith(".")) << to_string(state);
  }
}

TEST(NextStep, AfterAStopTheWayBackAndThenThePieces) {
  CellView view = in(CellState::kAborted);
  view.rest.emplace();
  view.rest->id = JobId{1};
  view.rest->pieces = 16, view.rest->cut = 4, view.rest->suspect = 1, view.rest->open = 11;
  CellNeeds needs = ready();
  needs.job = {1, "portrait", 11};
  EXPECT_EQ(next_step(view, needs).command, "veneerctl clear");
  view.state = CellState::kStopped;
  EXPECT_EQ(next_step(view, needs).sentence, "1 piece of job 1 is suspect: look at it, and say what became of it.");
  view.rest->suspect = 0, view.rest->missing = 2;
  EXPECT_EQ(next_step(view, needs).step, Step::kReset) << "what can be cut is cut first";
  view.rest->open = 0;
  needs.job.reset();
  EXPECT_EQ(next_step(view, needs).sentence, "2 pieces of job 1 are missing: find other wood for them.");
}

// The view of a cell that was started again knows of no job.
TEST(NextStep, SuspectPiecesOfEveryJobComeBeforeAnythingNew) {
  CellNeeds needs = ready();
  needs.job = {5, "leaf", 16};
  needs.suspects = {{JobId{3}, 1}};
  EXPECT_EQ(next_step(in(CellState::kStopped), needs).step, Step::kSettle);
  EXPECT_EQ(next_step(in(CellState::kStopped), needs).sentence,
            "1 piece of job 3 is suspect: look at it, and say what became of it.");
  EXPECT_EQ(next_step(in(CellState::kIdle), needs).command, "veneerctl job settle 3");
  needs.suspects = {{JobId{1}, 4}, {JobId{3}, 1}};
  EXPECT_EQ(next_step(in(CellState::kIdle), needs).sentence,
            "4 pieces of job 1 and 1 piece of job 3 are suspect: look at each, and say what became of each.");
  // What the unit knows of its own job is newer than what was counted.
  CellView view = in(CellState::kIdle);
  view.rest.emplace();
  view.rest->id = JobId{1};
  EXPECT_EQ(next_step(view, needs).sentence, "1 piece of job 3 is suspect: look at it, and say what became of it.");
  needs.suspects = {{JobId{1}, 1}, {JobId{2}, 1}, {JobId{3}, 2}, {JobId{4}, 1}, {JobId{6}, 1}};
  EXPECT_THAT(
      next_step(in(CellState::kIdle), needs).sentence,
      StartsWith(
          "1 piece of job 1, 1 piece of job 2, 2 pieces of job 3 and some pieces of 2 other jobs are suspect: "));
}

TEST(NextStep, MissingPiecesOfAnyJobAreLookedForOnceNoJobWaits) {
  CellNeeds needs = ready();
  needs.plan = {3, "portrait", 16};
  needs.missing = {{JobId{2}, 1}, {JobId{4}, 3}};
  const NextStep step = next_step(in(CellState::kStopped), needs);
  EXPECT_EQ(step.step, Step::kRedo);
  EXPECT_EQ(step.sentence, "1 piece of job 2 and 3 pieces of job 4 are missing: find other wood for them.");
  EXPECT_EQ(step.command, "veneerctl job redo 2");
  needs.job = {5, "leaf", 16};
  EXPECT_EQ(next_step(in(CellState::kStopped), needs).step, Step::kReset) << "what can be cut is cut first";
}

TEST(NextStep, AfterTheLastPieceThePiecesAreTakenOutAndAfterAPatternTheNextCertificateComes) {
  CellView view = in(CellState::kComplete);
  CellNeeds needs = ready();
  needs.certificates.back().state = CertificateState::kMissing;
  EXPECT_EQ(next_step(view, needs).step, Step::kCalibrateKerf) << "a pattern was burnt, and no job cut";
  view.job.emplace();
  EXPECT_THAT(next_step(view, needs).sentence, StartsWith("The cut is done: take the pieces out"));
}

TEST(NextStep, ADatabaseThatMayBeDamagedComesBeforeEverythingButTheMachine) {
  CellNeeds needs;
  needs.database_busy = "The database is being checked.";
  EXPECT_EQ(next_step(in(CellState::kStopped), needs).step, Step::kWait);
  needs.database_damaged = true;
  EXPECT_EQ(next_step(in(CellState::kStopped), needs).step, Step::kRepairDatabase);
  EXPECT_EQ(next_step(in(CellState::kHeld), needs).step, Step::kUnhold);
}

TEST(NextStep, EveryStepHasAWordOfItsOwn) {
  std::set<std::string_view> words;
  for (int step = 0; step <= static_cast<int>(Step::kRedo); ++step) words.insert(to_string(static_cast<Step>(step)));
  EXPECT_EQ(words.size(), static_cast<std::size_t>(Step::kRedo) + 1);
}

}  // namespace
}  // namespace veneer::daemon
