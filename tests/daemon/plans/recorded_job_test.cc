// A job of the cell, from its reserved pieces to bytes: its strokes are drawn by the planner of cuts, go through the
// unit and the real driver into a file, and the file burns the job on a simulated machine. Nothing is booked: a file
// cuts nothing, so the job itself is refused there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <cmath>
#include <optional>

#include "base/files.h"
#include "daemon/plans/cut_planner.h"
#include "daemon/unit/job_runner.h"
#include "daemon/wiring.h"
#include "tests/support/burn_check.h"
#include "tests/support/grbl_bench.h"
#include "tests/support/laid_bed.h"
#include "tests/support/lihuiyu_decode.h"
#include "tests/support/stocked_database.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

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
    config_.store.data_dir = dir_.path();
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
    const auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    if (!pieces) return pieces.error();
    return draw(*pieces);
  }
  Result<LaserJob> draw(const std::vector<db::PieceRecord>& pieces) {
    const ProvenPose pose{
        PanelId{"P-0001"}, true,
        Isometry2<BedFrame, PanelFrame>(Radians(0.02), point<BedFrame>(280, 40), Handedness::kImproper),
        Millimetres(0.02)};
    std::optional<Result<PreparedRun>> drawn;
    CutPlanner planner(io_, worker_, workers_, *database_, config_, make_null_logger());
    planner.prepare(pose, pieces, {}, [&](Result<PreparedRun> run) { drawn = std::move(run); });
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
    unit.home("test", [&](Status s) { homed = std::move(s); });
    const Status stands = wait_for(homed);
    ASSERT_TRUE(stands.ok()) << stands.error().message;
    unit.start_job(JobId{1}, "test", [&](Status s) { refused = std::move(s); });
    EXPECT_THAT(wait_for(refused).error().message, HasSubstr("a file that records"));
    unit.burn_pattern(
        job, "test", [&](Status s) { burnt = std::move(s); }, {}, Ok);
    const Status done = wait_for(burnt);
    ASSERT_TRUE(done.ok()) << done.error().message;
    const auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    for (const auto& piece : *pieces) EXPECT_EQ(piece.state, db::PieceState::kReserved) << "nothing is cut";
  }
  std::string recorded() const { return read_whole(wire()).value_or(""); }
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
  testing::WorkHere workers_;
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
// What a worker process says is not believed: the whole way of every stroke lies in its piece's own wood.
TEST_F(RecordedJob, IsRefusedWhereABeamWouldLeaveTheWoodThatIsBooked) {
  ASSERT_TRUE(draw().ok());
  workers_.spoil = [](const std::string&, nlohmann::json& answer) {
    auto& x = answer["strokes"].back()["path"][1][0];
    x = x.get<double>() + 2;
  };
  const auto refused = draw();
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("leaves the wood that is booked for it"));
}

// Nor may its kerf: a way that lies 0.12 mm aside has its middle, all of it, still in the band that is booked.
TEST_F(RecordedJob, IsRefusedWhereABeamWouldBurnBesideTheWoodThatIsBooked) {
  double aside = 0;
  workers_.spoil = [&aside](const std::string&, nlohmann::json& answer) {
    for (nlohmann::json& p : answer["strokes"].back()["path"]) p[0] = p[0].get<double>() + aside;
  };
  for (const double rounding : {-0.03, 0.03}) {
    aside = rounding;
    EXPECT_TRUE(draw().ok()) << aside;
  }
  for (const double beside : {-0.12, 0.12}) {
    aside = beside;
    const auto job = draw();
    ASSERT_FALSE(job.ok()) << aside;
    EXPECT_THAT(job.error().message, HasSubstr("leaves the wood that is booked for it")) << aside;
  }
}

TEST_F(RecordedJob, IsRefusedWhereNoWoodIsBooked) {
  Result<std::vector<db::PieceRecord>> pieces =
      database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
  ASSERT_TRUE(pieces.ok());
  pieces->front().allocation = db::AllocationId{4711};
  EXPECT_THAT(draw(*pieces).error().message, HasSubstr("no wood is booked for piece " + pieces->front().mark));
}

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

// What the packets of a recording say, each checked by its sum: programs, and M3's settings of power.
struct Packets {
  std::string programs;
  std::vector<int> permille;
  std::string broken;
};
Packets packets_of(const std::string& wire) {
  constexpr std::size_t kPacket = 34, kHead = 2, kPayload = 30;
  Packets out;
  if (wire.size() % kPacket != 0) out.broken = "a packet is cut off";
  for (std::size_t at = 0; at + kPacket <= wire.size(); at += kPacket) {
    const std::string packet = wire.substr(at, kPacket), payload = packet.substr(kHead, kPayload);
    // Of the 1-wire bus: x^8 + x^5 + x^4 + 1, the lowest bit first.
    unsigned sum = 0;
    for (const char byte : payload) {
      sum ^= static_cast<unsigned char>(byte);
      for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0x8CU : 0U);
    }
    if (packet[0] != '\xA6' || packet[1] != 0 || packet[kPacket - 2] != '\xA6' ||
        static_cast<unsigned char>(packet.back()) != sum)
      out.broken = fmt::format("the packet at byte {}", at);
    if (payload.substr(0, 3) == "AT1")
      out.permille.push_back(static_cast<unsigned char>(payload[3]) * 254 + static_cast<unsigned char>(payload[4]));
    else
      out.programs += payload;
  }
  return out;
}

bool near(const tests::MilSegment& s, const std::vector<tests::MilSegment>& path) {
  constexpr double kRoom = 8;  // mils
  return std::any_of(path.begin(), path.end(), [&](const tests::MilSegment& p) {
    return std::max(s.ax, s.bx) > std::min(p.ax, p.bx) - kRoom && std::min(s.ax, s.bx) < std::max(p.ax, p.bx) + kRoom &&
           std::max(s.ay, s.by) > std::min(p.ay, p.by) - kRoom && std::min(s.ay, s.by) < std::max(p.ay, p.by) + kRoom;
  });
}

class RecordedLihuiyuJob : public RecordedJob, public ::testing::WithParamInterface<const char*> {};

// Read back by the simulator's interpreter. On both boards the head runs along each stroke within half a mil, and burns
// nowhere else; an M3 burns all the way, an M2 in pulses.
TEST_P(RecordedLihuiyuJob, IsWhatTheBoardBurns) {
  constexpr double kTravelY = 380, kHalfMil = 0.5 + 1e-6;
  config_.laser.kind = "lihuiyu";
  config_.laser.board = GetParam();
  config_.laser.travel_x = Millimetres(520);
  config_.laser.travel_y = Millimetres(kTravelY);
  const bool pulsed = config_.laser.board == "m2";
  const auto job = draw();
  ASSERT_TRUE(job.ok()) << job.error().message;
  record(*job);

  const Packets packets = packets_of(recorded());
  EXPECT_EQ(packets.broken, "");
  EXPECT_EQ(packets.permille.empty(), pulsed);
  const auto decoded = tests::decode(packets.programs);
  EXPECT_THAT(decoded.complaints, ::testing::IsEmpty());
  std::size_t move = 0, burnt = 0;
  struct Run {
    tests::MilSegment way;
    double mm_s;
  };
  std::vector<Run> runs;  // at a program's own speed
  for (const sim::GlAction& action : decoded.actions) {
    if (action.kind != sim::GlAction::Kind::kMove) continue;
    const tests::MilSegment& way = decoded.moves[move++];
    if (action.compact) runs.push_back({way, 0.0254 / action.speed.step_seconds()});
    burnt += way.beam ? 1 : 0;
  }
  std::size_t found = 0;  // a lit way is of one stroke, or of two that meet
  for (const Stroke& stroke : job->strokes) {
    const auto path = tests::on_board(stroke.path, kTravelY);
    std::vector<tests::MilSegment> run, lit;
    for (const auto& [way, mm_s] : runs) {
      if (std::abs(mm_s / stroke.speed.count() - 1) > 0.01 || !near(way, path)) continue;
      run.push_back(way);
      if (way.beam) lit.push_back(way);
    }
    found += lit.size();
    EXPECT_LE(tests::farthest(path, run), kHalfMil);
    // No glyph has a stroke as short as a pulse and its gap.
    const double half_gap = pulsed ? std::ceil(1 / stroke.power.count() + 0.5) / 2 : 0;
    EXPECT_LE(tests::farthest(path, lit), kHalfMil + half_gap) << stroke.power.count();
  }
  EXPECT_GE(found, burnt);
  std::vector<tests::MilSegment> all, lit;
  for (const Stroke& stroke : job->strokes)
    for (const auto& leg : tests::on_board(stroke.path, kTravelY)) all.push_back(leg);
  for (const Run& run : runs)
    if (run.way.beam) lit.push_back(run.way);
  EXPECT_LE(tests::farthest(lit, all), kHalfMil);
}
INSTANTIATE_TEST_SUITE_P(Boards, RecordedLihuiyuJob, ::testing::Values("m2", "m3"),
                         [](const auto& board) { return std::string(board.param); });

}  // namespace
}  // namespace veneer::daemon
