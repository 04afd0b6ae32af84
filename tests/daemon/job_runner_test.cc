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
  void prepare(const ProvenPose&, std::vector<db::PieceRecord> pieces,
               std::function<void(Result<std::vector<PieceBurn>>)> reply) override {
    std::vector<PieceBurn> burns;
    for (const auto& piece : pieces) {
      Stroke stroke;
      stroke.piece = piece.id;
      stroke.path = {point<MachineFrame>(0, 0), point<MachineFrame>(10, 0)};
      burns.push_back({piece.id, piece.mark, LaserJob{{stroke}}, 1});
    }
    boost::asio::post(io_, [burns = std::move(burns), reply = std::move(reply)] { reply(burns); });
  }
  void lay(const std::string& panel, bool back_up = true, double x_mm = 300) {
    seen = ProvenPose{PanelId{panel}, back_up,
                      Isometry2<BedFrame, PanelFrame>(Radians(0), point<BedFrame>(x_mm, 40),
                                                      back_up ? Handedness::kImproper : Handedness::kProper),
                      Millimetres(0.02)};
  }
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
    runner_ = std::make_unique<JobRunner>(io_, laser_, *database_, bed_, make_null_logger(), [] {});
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

  Status command(CellCommand command) {
    std::optional<Status> out;
    runner_->command(command, "test", [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status start() {
    std::optional<Status> out;
    runner_->start_job(JobId{1}, "test", [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
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

}  // namespace
}  // namespace veneer::daemon
