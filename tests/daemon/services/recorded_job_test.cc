// A job of the cell, from its reserved pieces to bytes: its strokes are drawn by the planner of cuts, go through the
// unit and the real driver into a file, and the file burns the job on a simulated machine. Nothing is booked: a file
// cuts nothing, so the job itself is refused there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <fstream>
#include <optional>

#include "daemon/services/cut_planner.h"
#include "daemon/unit/job_runner.h"
#include "daemon/wiring.h"
#include "tests/support/burn_check.h"
#include "tests/support/grbl_bench.h"
#include "tests/support/laid_bed.h"
#include "tests/support/stocked_database.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

constexpr int kPieces = 4;  // of the one panel that the job is cut from

class RecordedJob : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(dir_ / "test.db", io_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    const Status stocked = tests::stock_two_panels(*database_, kPieces, 0);
    ASSERT_TRUE(stocked.ok()) << stocked.error().message;
    config_.laser.port = "file:" + wire().string();
    config_.scanner.kind = config_.camera.kind = "file";
  }
  std::filesystem::path wire() const { return dir_ / "wire"; }

  // Runs the reactor until `reply` has come.
  template <class T>
  T wait_for(const std::optional<T>& reply) {
    while (!reply && io_.run_one_for(std::chrono::seconds(60)) > 0) continue;
    return reply ? *reply : T(Error{ErrorCode::kTimeout, "no answer"});
  }
  // All strokes of the job, as a panel that lies there would be cut.
  Result<LaserJob> draw() {
    const ProvenPose pose{
        PanelId{"P-0001"}, true,
        Isometry2<BedFrame, PanelFrame>(Radians(0.02), point<BedFrame>(280, 40), Handedness::kImproper),
        Millimetres(0.02)};
    auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    if (!pieces) return pieces.error();
    std::optional<Result<PreparedRun>> drawn;
    CutPlanner planner(io_, worker_, *database_, config_, make_null_logger());
    planner.prepare(pose, *pieces, {}, [&](Result<PreparedRun> run) { drawn = std::move(run); });
    auto run = wait_for(drawn);
    if (!run) return run.error();
    LaserJob all;
    for (const PieceBurn& burn : run->burns)
      all.strokes.insert(all.strokes.end(), burn.strokes.strokes.begin(), burn.strokes.strokes.end());
    return all;
  }
  // Through the unit and the driver that the configuration names.
  void record(const LaserJob& job) {
    auto devices = make_devices(config_, clock_, io_, make_null_logger());
    ASSERT_TRUE(devices.ok()) << devices.error().message;
    tests::LaidBed bed(io_);
    JobRunner unit(io_, UnitParts{*devices->laser, *database_, bed, bed}, {}, make_null_logger(), [] {});
    std::optional<Status> homed, refused, burnt;
    unit.command(CellCommand::kReset, "test", [&](Status s) { homed = std::move(s); });
    const Status stands = wait_for(homed);
    ASSERT_TRUE(stands.ok()) << stands.error().message;
    unit.start_job(JobId{1}, "test", [&](Status s) { refused = std::move(s); });
    EXPECT_THAT(wait_for(refused).error().message, HasSubstr("a file that records"));
    unit.burn_pattern(job, "test", [&](Status s) { burnt = std::move(s); });
    const Status done = wait_for(burnt);
    ASSERT_TRUE(done.ok()) << done.error().message;
    const auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    for (const auto& piece : *pieces) EXPECT_EQ(piece.state, db::PieceState::kReserved) << "nothing is cut";
  }
  std::string recorded() const {
    std::ifstream file(wire(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // To be compared with all that was burnt, whatever piece it is of.
  static LaserJob as_one_piece(LaserJob job) {
    for (Stroke& stroke : job.strokes) stroke.piece = PieceId{1};
    return job;
  }

  testing::TempDirectory dir_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  SteadyClock clock_;
  Config config_;
  std::unique_ptr<DatabaseThread> database_;
  Worker worker_{"planner"};
};

// The recording has its zero where it homes, lower left; stock GRBL that homes there has the far corner's negative
// travel.
std::string as_stock_grbl(const std::string& line) {
  double x = 0, y = 0;
  if (std::sscanf(line.c_str(), "G53G0X%lfY%lf", &x, &y) != 2) return line;
  return fmt::format("G53G0X{:.3f}Y{:.3f}S0\n", x - 520, y - 380);
}

// Fed as a sender feeds a controller that it waits for.
TEST_F(RecordedJob, OfAGrblLaserBurnsWholeOnASimulatedController) {
  config_.laser.kind = "grbl";
  config_.laser.travel_x = Millimetres(520);
  config_.laser.travel_y = Millimetres(380);
  const auto job = draw();
  ASSERT_TRUE(job.ok()) << job.error().message;
  record(*job);

  sim::GrblSettings settings = sim::GrblSettings::laser_cutter();
  settings.set(23, 3);
  settings.set(27, 0);
  sim::GrblBench bench(settings);
  bench.controller.power_on(bench.clock.now());
  std::string line, said;
  for (const char byte : recorded()) {
    line += byte;
    const auto code = static_cast<unsigned char>(byte);
    if (byte != '\n' && code != 0x18 && code < 0x80 && byte != '!' && byte != '~') continue;
    said = bench.send(as_stock_grbl(line));
    if (byte == '\n') said += bench.run_out();
    EXPECT_EQ(said.find("error:"), std::string::npos) << line << said;
    line.clear();
  }
  EXPECT_EQ(tests::wrong_burn(as_one_piece(*job), PieceId{1}, bench.burns), "");
}

}  // namespace
}  // namespace veneer::daemon
