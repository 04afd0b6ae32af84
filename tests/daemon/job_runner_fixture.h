// A job runner on a simulated laser, with two panels in stock and a job of three pieces.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "calib/camera_fit.h"
#include "calib/machine_axes.h"
#include "daemon/calibration.h"
#include "daemon/job_runner.h"
#include "tests/support/sim_laser.h"

namespace veneer::daemon {

inline constexpr const char* kThen = "2026-01-01T00:00:00.000Z";

inline Box<MachineFrame> whole_bed() {
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
  void prepare(const ProvenPose&, std::vector<db::PieceRecord> pieces, const std::optional<LaserMotion>& machine,
               std::function<void(Result<std::vector<PieceBurn>>)> reply) override {
    told = machine;
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
  std::optional<LaserMotion> told;  // of the machine, last
  double reach_x = 20;              // how far to the right each cut goes
  std::vector<RunSetup> setups;     // empty: one for each panel
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

}  // namespace veneer::daemon
