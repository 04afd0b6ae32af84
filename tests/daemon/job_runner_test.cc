#include "daemon/job_runner.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "calib/camera_fit.h"
#include "calib/machine_axes.h"
#include "daemon/calibration.h"
#include "tests/support/sim_laser.h"

namespace veneer::daemon {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kThen = "2026-01-01T00:00:00.000Z";

Box<MachineFrame> whole_bed() {
  Box<MachineFrame> bed;
  bed.add(point<MachineFrame>(0, 0));
  bed.add(point<MachineFrame>(520, 380));
  return bed;
}

// The bed as a test lays it: one panel or none, any way up.
class LaidBed final : public RunSupport {
 public:
  explicit LaidBed(boost::asio::io_context& io) : io_(io) {}
  void look(std::function<void(Result<ProvenPose>)> reply) override {
    boost::asio::post(io_, [seen = seen, reply = std::move(reply)] { reply(seen); });
  }
  // One set-up for each panel, or as a test says.
  void plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame>,
                   std::function<void(Result<std::vector<RunSetup>>)> reply) override {
    std::vector<RunSetup> out = setups;
    for (const auto& piece : pieces) {
      if (!setups.empty()) break;
      if (out.empty() || out.back().panel != *piece.panel) out.push_back({*piece.panel, {}, {}, 1, 1, {}});
      out.back().pieces.push_back(piece.id);
    }
    boost::asio::post(io_, [out = std::move(out), reply = std::move(reply)] { reply(out); });
  }
  void prepare(const ProvenPose&, std::vector<db::PieceRecord> pieces,
               std::function<void(Result<std::vector<PieceBurn>>)> reply) override {
    std::vector<PieceBurn> burns;
    for (const auto& piece : pieces) {
      Stroke mark;
      mark.piece = piece.id;
      mark.role = StrokeRole::kEngrave;
      mark.path = {point<MachineFrame>(12, 12), point<MachineFrame>(14, 12)};
      mark.speed = MmPerSecond(80);
      mark.power = PowerFraction(0.2);
      Stroke cut = mark;
      cut.role = StrokeRole::kCut;
      cut.path = {point<MachineFrame>(10, 10), point<MachineFrame>(reach_x, 10), point<MachineFrame>(15, 20)};
      burns.push_back({piece.id, piece.mark, LaserJob{{mark, cut}}, 1});
    }
    boost::asio::post(io_, [burns = std::move(burns), reply = std::move(reply)] { reply(burns); });
  }
  void lay(const std::string& panel, bool back_up = true, double x_mm = 300) {
    seen = ProvenPose{PanelId{panel}, back_up,
                      Isometry2<BedFrame, PanelFrame>(Radians(0), point<BedFrame>(x_mm, 40),
                                                      back_up ? Handedness::kImproper : Handedness::kProper),
                      Millimetres(0.02)};
  }
  double reach_x = 20;           // how far to the right each cut goes
  std::vector<RunSetup> setups;  // empty: one for each panel
  Result<ProvenPose> seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};

 private:
  boost::asio::io_context& io_;
};

class JobRunnerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ =
        std::filesystem::temp_directory_path() /
        fmt::format("veneer-runner-{}-{}", getpid(), ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(dir_);
    auto opened = DatabaseThread::open(dir_ / "test.db", io_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    stock();
    make_runner();
  }
  void TearDown() override {
    runner_.reset();
    database_.reset();
    std::filesystem::remove_all(dir_);
  }

  void make_runner() {
    runner_ = std::make_unique<JobRunner>(io_, laser_, *database_, bed_, options_, make_null_logger(), [] {});
  }

  // Two panels; a job with two pieces on the first and one on the second.
  void stock() {
    const Status stocked = database_->call([](Repositories& r) -> Status {
      for (const char* name : {"P-0001", "P-0002"}) {
        db::PanelRecord panel;
        panel.id = PanelId{name};
        panel.name = name;
        panel.width = Millimetres(200);
        panel.height = Millimetres(100);
        panel.created_at = kThen;
        if (Status added = r.panels.add(panel, {}, {}); !added) return added;
      }
      for (const auto& [kind, payload] :
           {std::pair(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}).dump()),
            std::pair(db::CertificateKind::kAxes,
                      to_payload(calib::MachineAxes{}, CertificateId{1}, whole_bed()).dump()),
            std::pair(db::CertificateKind::kKerf, std::string("{\"kerf_mm\":0.27}"))}) {
        db::CertificateRecord certificate;
        certificate.kind = kind;
        certificate.issued_at = kThen;
        certificate.expires_at = "2999-01-01T00:00:00.000Z";
        certificate.payload = payload;
        if (auto issued = r.certificates.issue(certificate); !issued) return issued.error();
      }
      db::NewJob job;
      job.name = "test";
      job.plan_json = job.options_json = "{}";
      for (int i = 0; i < 3; ++i) {
        db::NewPiece& piece = job.pieces.emplace_back();
        const double x = 20 * (i % 2);
        piece.mark = fmt::format("A1-{}", i + 1);
        piece.artwork_outline = {point<ArtworkFrame>(x, 0), point<ArtworkFrame>(x + 10, 0),
                                 point<ArtworkFrame>(x + 10, 10)};
        piece.panel = PanelId{i < 2 ? "P-0001" : "P-0002"};
        piece.panel_outline = {point<PanelFrame>(x, 0), point<PanelFrame>(x + 10, 0), point<PanelFrame>(x + 10, 10)};
        piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.27));
      }
      auto id = r.jobs.create(job, kThen);
      return id ? Ok() : Status(id.error());
    });
    ASSERT_TRUE(stocked.ok()) << stocked.error().message;
  }

  // Runs the reactor until nothing is left to do, the database's thread included.
  void settle() {
    for (int i = 0; i < 200; ++i) {
      database_->call([](Repositories&) { return 0; });
      io_.restart();
      if (io_.poll() == 0 && i > 2) return;
    }
    FAIL() << "the reactor does not come to rest";
  }

  Status command(CellCommand command, std::vector<std::string> confirmed = {}) {
    std::optional<Status> out;
    runner_->command(
        command, "test", [&](Status s) { out = std::move(s); }, std::move(confirmed));
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status start() {
    std::optional<Status> out;
    runner_->start_job(JobId{1}, "test", [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status frame(double power = 0) {
    std::optional<Status> out;
    runner_->frame(PowerFraction(power), "test", [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status recut(std::vector<std::string> marks, std::vector<std::string> confirmed = {}) {
    std::optional<Status> out;
    runner_->recut(std::move(marks), std::move(confirmed), "test", [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  std::string sentence() const { return runner_->view().load ? runner_->view().load->sentence : ""; }
  void look() {
    runner_->look_again();
    settle();
  }
  CellState state() const { return runner_->view().state; }
  std::vector<db::PieceState> piece_states() {
    auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    std::vector<db::PieceState> out;
    for (const auto& piece : *pieces) out.push_back(piece.state);
    return out;
  }
  db::JobState job_state() {
    return database_->call([](Repositories& r) { return r.jobs.find(JobId{1}); })->state;
  }
  // Idle -> Suspended with the first panel laid and found.
  void load_first_panel() {
    ASSERT_TRUE(command(CellCommand::kReset).ok());
    ASSERT_TRUE(start().ok());
    bed_.lay("P-0001");
    look();
    ASSERT_TRUE(runner_->view().load && runner_->view().load->found);
  }

  boost::asio::io_context io_;
  std::filesystem::path dir_;
  std::unique_ptr<DatabaseThread> database_;
  tests::SimLaser laser_{io_};
  LaidBed bed_{io_};
  RunnerOptions options_;
  std::unique_ptr<JobRunner> runner_;
};

using P = db::PieceState;

TEST_F(JobRunnerTest, NothingIsAskedOfTheLaserBeforeAnOperatorsReset) {
  settle();
  look();
  EXPECT_TRUE(laser_.calls.empty());
  EXPECT_EQ(state(), CellState::kStopped);
}

TEST_F(JobRunnerTest, ResetConnectsAndHomes) {
  EXPECT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_THAT(laser_.calls, ElementsAre("connect", "home"));
  EXPECT_EQ(state(), CellState::kIdle);
}

TEST_F(JobRunnerTest, ResetWithoutALaserEndsAbortedAndSaysWhy) {
  laser_.present = false;
  const Status reset = command(CellCommand::kReset);
  ASSERT_FALSE(reset.ok());
  EXPECT_THAT(reset.error().message, HasSubstr("no laser at this port"));
  EXPECT_EQ(state(), CellState::kAborted);
}

TEST_F(JobRunnerTest, StartWaitsSuspendedForTheFirstPanel) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  ASSERT_TRUE(runner_->view().load);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0001");
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, UnsuspendIsRefusedUntilTheRightPanelLiesBackUp) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_FALSE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message,
              HasSubstr("P-0002 is on the bed, but P-0001 is wanted"));
  bed_.lay("P-0001", false);
  look();
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("turn it over"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, APanelThatMovedSinceItWasShownIsRefused) {
  load_first_panel();
  bed_.lay("P-0001", true, 301);
  const Status unsuspended = command(CellCommand::kUnsuspend);
  ASSERT_FALSE(unsuspended.ok());
  EXPECT_THAT(unsuspended.error().message, HasSubstr("moved by 1.0 mm"));
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, CutsPanelByPanelAndAsksForTheOperatorsWordEachTime) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(laser_.burnt.size(), 2U);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kComplete);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kCut));
  EXPECT_EQ(job_state(), db::JobState::kComplete);
}

TEST_F(JobRunnerTest, APieceIsNotedBeforeItsFirstStroke) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(laser_.burning());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCutting, P::kReserved, P::kReserved));
}

TEST_F(JobRunnerTest, StopReachesTheLaserAtOnceAndLeavesThePieceSuspect) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.calls.clear();
  runner_->abort("STOP");
  EXPECT_THAT(laser_.calls, ElementsAre("abort"));  // before the reactor turns once
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kAborted);
}

TEST_F(JobRunnerTest, ALostLinkEndsAbortedAndNothingGoesOnByItself) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.fail({ErrorCode::kDisconnected, "the laser's link is gone"});
  settle();
  laser_.calls.clear();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_FALSE(start().ok());
  EXPECT_TRUE(laser_.calls.empty());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

TEST_F(JobRunnerTest, TheRemainingPiecesCanBeCutAfterClearAndReset) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.fail({ErrorCode::kDeviceFault, "ALARM:1"});
  settle();
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, HoldStopsInThePieceAndUnholdGoesOn) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);  // both pieces cut, waiting for the second panel
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, UnholdUnderAnOpenLidStaysHeldAndSaysSo) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  laser_.lid_open = true;
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_THAT(unheld.error().message, HasSubstr("close the lid"));
  EXPECT_EQ(state(), CellState::kHeld);
}

TEST_F(JobRunnerTest, ALidOpenedBetweenTwoPiecesHoldsUntilTheOperatorSaysSo) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.lid_was_open = true;  // in the instant between this piece and the next
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "start"), 1);
  laser_.lid_open = true;
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("lid is open"));
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.lid_open = false;
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  settle();
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "start"), 2);
}

TEST_F(JobRunnerTest, AMachineThatDropsOutAtRestEndsAborted) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.say(laser_event::Fault{{ErrorCode::kDisconnected, "the laser was unplugged"}, false});
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("unplugged"));
}

TEST_F(JobRunnerTest, StopAfterThisPieceFinishesItAndLeavesTheRestReserved) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  Status taken = Ok();
  runner_->stop_after_piece("test", [&](Status s) { taken = std::move(s); });
  EXPECT_TRUE(taken.ok());
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kStopped);
}

TEST_F(JobRunnerTest, StopWhileSuspendedLeavesTheJobToBeStartedAgain) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_TRUE(start().ok());
}

TEST_F(JobRunnerTest, AfterACrashTheCellIsAbortedUntilSomebodyLooks) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  auto recovery = database_->call([](Repositories& r) { return r.jobs.recover(kThen); });  // as the next start does
  ASSERT_TRUE(recovery.ok());
  make_runner();
  runner_->begin(*recovery);
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("1 piece(s) are suspect"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

// ---- Before motion -----------------------------------------------------------------------------------------------

TEST_F(JobRunnerTest, AJobThatLeavesTheTravelIsRefusedBeforeAnythingMoves) {
  bed_.reach_x = 530;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001");
  look();
  EXPECT_FALSE(runner_->view().load->found);
  EXPECT_THAT(sentence(), HasSubstr("10.0 mm at the right side: move the panel to the left"));
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("right side"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, AMachineThatFindsNoHomeCutsNoJob) {
  laser_.finds_home = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_THAT(start().error().message, HasSubstr("homing switches"));
  EXPECT_EQ(state(), CellState::kIdle);
}

TEST_F(JobRunnerTest, AZoneWhereTheHeadMustNotGoIsHeeded) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(16, 0));
  clamp.add(point<MachineFrame>(18, 40));
  options_.keep_out = {{"clamp", clamp}};
  make_runner();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001");
  look();
  EXPECT_THAT(sentence(), HasSubstr("\"clamp\""));
  EXPECT_FALSE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, AnOpenLidIsARefusalAndNotAnAbort) {
  load_first_panel();
  laser_.lid_open = true;
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("lid is open"));
  EXPECT_EQ(state(), CellState::kSuspended);
  look();
  EXPECT_THAT(sentence(), HasSubstr("close it"));
  laser_.lid_open = false;
  look();
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, WhatAnOperatorMustConfirmIsAskedByNameEachTime) {
  options_.confirm = {"exhaust", "focus at 2.1 mm"};
  make_runner();
  load_first_panel();
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("exhaust, focus at 2.1 mm"));
  EXPECT_THAT(command(CellCommand::kUnsuspend, {"exhaust"}).error().message,
              HasSubstr("confirm before the beam comes on: focus"));
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
  ASSERT_TRUE(command(CellCommand::kUnsuspend, {"focus at 2.1 mm", "exhaust"}).ok());
  // The second panel: hands were in the machine again.
  bed_.lay("P-0002");
  look();
  EXPECT_FALSE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, APatternIsCheckedAndConfirmedAsWell) {
  options_.confirm = {"exhaust"};
  make_runner();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  Stroke stroke;
  stroke.path = {point<MachineFrame>(10, 10), point<MachineFrame>(900, 10)};
  stroke.speed = MmPerSecond(10);
  stroke.power = PowerFraction(0.2);
  std::optional<Status> out;
  runner_->burn_pattern(LaserJob{{stroke}}, "test", [&](Status s) { out = std::move(s); });
  EXPECT_THAT(out->error().message, HasSubstr("exhaust"));
  runner_->burn_pattern(LaserJob{{stroke}}, "test", [&](Status s) { out = std::move(s); }, {"exhaust"});
  EXPECT_THAT(out->error().message, HasSubstr("leave the machine's travel"));
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, TheEstimateIsThereBeforeUnsuspend) {
  load_first_panel();
  EXPECT_DOUBLE_EQ(runner_->view().load->seconds, 2);
  EXPECT_THAT(sentence(), HasSubstr("2 pieces: press"));
}

TEST_F(JobRunnerTest, TheFrameIsTracedDarkAndCutsNothing) {
  EXPECT_FALSE(frame().ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_FALSE(frame().ok());  // nothing lies there
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(frame().ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].power.count(), 0);
  EXPECT_EQ(laser_.jobs[0].strokes[0].path.front(), laser_.jobs[0].strokes[0].path.back());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(runner_->view().framing);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, TheFrameTakesALowPowerAndNoMore) {
  load_first_panel();
  EXPECT_THAT(frame(0.5).error().message, HasSubstr("at most 3.0 % power"));
  EXPECT_FALSE(frame(-0.1).ok());
  EXPECT_FALSE(frame(std::nan("")).ok());
  ASSERT_TRUE(frame(0.02).ok());
  EXPECT_DOUBLE_EQ(laser_.jobs.at(0).strokes[0].power.count(), 0.02);
}

TEST_F(JobRunnerTest, WhileTheFrameIsTracedNothingElseBeginsAndStopStops) {
  load_first_panel();
  laser_.burn_at_once = false;
  std::optional<Status> traced;
  runner_->frame(PowerFraction(0), "test", [&](Status s) { traced = std::move(s); });
  settle();
  EXPECT_TRUE(runner_->view().framing);
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("being traced"));
  EXPECT_FALSE(frame().ok());
  EXPECT_FALSE(traced);
  laser_.calls.clear();
  runner_->abort("STOP");
  EXPECT_THAT(laser_.calls, ElementsAre("abort"));
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  ASSERT_TRUE(traced);
  EXPECT_FALSE(traced->ok());
  EXPECT_FALSE(runner_->view().framing);
}

TEST_F(JobRunnerTest, ALidOpenedOverTheFrameEndsIt) {
  load_first_panel();
  laser_.burn_at_once = false;
  runner_->frame(PowerFraction(0), "test", [](const Status&) {});
  settle();
  laser_.say(laser_event::Held{});
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(laser_.calls, Contains("abort"));
}

// ---- Recut -------------------------------------------------------------------------------------------------------

TEST_F(JobRunnerTest, OnlyTheCutOfAPieceIsRepeatedAndItIsBookedOnce) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended);  // the second panel is waited for, the first still lies there
  EXPECT_EQ(runner_->view().can_recut, 2);
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-2"}).ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].role, StrokeRole::kCut);
  EXPECT_EQ(laser_.jobs[0].strokes[0].piece.value, 2);
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
  EXPECT_EQ(runner_->view().job->cut, 2);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, ACompleteJobCanBeCutAgainUntilReset) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kComplete);
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("not cut from panel P-0002"));  // another panel's
  ASSERT_TRUE(recut({"A1-3"}).ok());
  EXPECT_EQ(state(), CellState::kComplete);
  EXPECT_EQ(job_state(), db::JobState::kComplete);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_FALSE(recut({"A1-3"}).ok());
}

TEST_F(JobRunnerTest, APanelThatMovedIsNotCutAgain) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.jobs.clear();
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  bed_.lay("P-0002");
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_EQ(state(), CellState::kSuspended);
}

TEST_F(JobRunnerTest, ARecutNeedsTheSameConfirmationsAndAClosedLid) {
  options_.confirm = {"exhaust"};
  make_runner();
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend, {"exhaust"}).ok());
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_FALSE(recut({}, {"exhaust"}).ok());
  EXPECT_FALSE(recut({"A9-9"}, {"exhaust"}).ok());
  laser_.lid_open = true;
  EXPECT_THAT(recut({"A1-1"}, {"exhaust"}).error().message, HasSubstr("lid is open"));
  laser_.lid_open = false;
  EXPECT_TRUE(recut({"A1-1"}, {"exhaust"}).ok());
}

TEST_F(JobRunnerTest, ARecutThatIsBrokenOffNamesThePiece) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-2"}).ok());
  EXPECT_EQ(state(), CellState::kExecute);
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("piece A1-2 was being cut again: look at it"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().can_recut, 0);
}

TEST_F(JobRunnerTest, ALidOpenedBetweenTwoRecutsEndsThem) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  laser_.lid_was_open = true;
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("lid was opened"));
}

TEST_F(JobRunnerTest, ARecutCanBeHeld) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
}

TEST_F(JobRunnerTest, StopAfterThisPieceLetsThePanelLeaveAndTheRestBeCutInANewPose) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  runner_->stop_after_piece("test", [](const Status&) {});
  laser_.finish();
  settle();
  ASSERT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(runner_->view().can_recut, 1);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001", true, 250);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

// ---- Several set-ups ---------------------------------------------------------------------------------------------

TEST_F(JobRunnerTest, APanelInTwoSetUpsIsAskedForTwiceAndEachTimeOnlyItsPiecesAreCut) {
  bed_.setups = {{PanelId{"P-0001"}, {PieceId{2}}, "200 mm of it sticking out on the left", 1, 2, {}},
                 {PanelId{"P-0001"}, {PieceId{1}}, "200 mm of it sticking out on the right", 2, 2, {}},
                 {PanelId{"P-0002"}, {PieceId{3}}, "", 1, 1, {}}};
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_THAT(sentence(), HasSubstr("200 mm of it sticking out on the left; set-up 1 of 2"));
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().load->setup.number, 2);
  bed_.lay("P-0001", true, 120);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
}

}  // namespace
}  // namespace veneer::daemon
