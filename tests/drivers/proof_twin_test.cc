// The whole of the twin in one process: a panel on the bed, G-code in bytes to the controller, its burns into the
// world, the pieces lifted out, and the proof over what lies on disk. The cell's part is played with perfect knowledge,
// so what the figures show is the error of machine, twin and proof together.
#include <gmock/gmock.h>

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/grbl_controller/grbl_controller.h"
#include "drivers/sim/proof/proof.h"
#include "drivers/sim/world.h"
#include "tests/support/stroke_font.h"

namespace veneer::proof {
namespace {

constexpr double kSide = 14;
constexpr double kPitch = 20.5;

// Sends lines as a sender does that counts characters.
class Streamer {
 public:
  explicit Streamer(sim::World& world) : controller_(sim::GrblSettings::laser_cutter(), {}, 3, &world) {
    controller_.power_on(clock_.now());
    send("$H");
    drain();
  }
  void send(const std::string& line) {
    while (in_flight_ + line.size() + 1 > 128) step();
    lengths_.push_back(line.size() + 1);
    in_flight_ += line.size() + 1;
    controller_.receive(line + "\n", clock_.now());
    collect();
  }
  void drain() {
    while (!lengths_.empty() || controller_.next_event_time()) step();
  }
  const sim::BeamLog& log() const { return controller_.beam_log(); }
  double seconds() const { return std::chrono::duration<double>(clock_.now().time_since_epoch()).count(); }

 private:
  void step() {
    if (const auto next = controller_.next_event_time())
      if (*next > clock_.now()) clock_.advance(*next - clock_.now());
    controller_.advance_to(clock_.now());
    collect();
  }
  void collect() {
    const std::string said = controller_.take_output();
    ASSERT_EQ(said.find("error"), std::string::npos) << said;
    for (std::size_t at = said.find("ok\r\n"); at != std::string::npos; at = said.find("ok\r\n", at + 1)) {
      in_flight_ -= lengths_.front();
      lengths_.erase(lengths_.begin());
    }
  }
  ManualClock clock_;
  sim::GrblController controller_;
  std::vector<std::size_t> lengths_;
  std::size_t in_flight_ = 0;
};

class TwinRun {
 public:
  TwinRun(std::filesystem::path dir, double width, double height) : dir_(std::move(dir)) {
    std::filesystem::remove_all(dir_);
    std::filesystem::create_directories(dir_);
    sim::TwinSettings settings;
    settings.seed = 5;
    settings.sheet_dpi = 300;
    world_ = std::move(*sim::World::open(settings, dir_, make_null_logger()));
    EXPECT_TRUE(world_->new_panel("wood", width, height, 0).ok());
    EXPECT_TRUE(world_->place("wood", sim::Spot::kBed, sim::SheetFace::kBack, "whole", 0).ok());
    const auto placed = world_->snapshot(sim::Spot::kBed);
    pose_ = placed->placement.pose;
    sheet_ = placed->sheet;
  }

  // Cuts pieces on a square pitch over the veneer, turned by multiples of 24 degrees.
  void cut() {
    Streamer laser(*world_);
    laser.send("G21 G90 M4 S0");
    const int columns = static_cast<int>((sheet_->width_mm - 60) / kPitch);
    const int rows = static_cast<int>((sheet_->height_mm - 60) / kPitch);
    for (int i = 0; i < columns * rows; ++i) {
      Rigid sheet_from_artwork = Rigid::turn((i % 15) * 24 * 0.017453292519943295);
      const int column = i % columns, row = i / columns;
      const Vec2 low{column * kSide, (rows - 1 - row) * kSide};
      const Vec2 at{30 + kPitch * (column + 0.5), 30 + kPitch * (row + 0.5)};
      sheet_from_artwork.shift = at - sheet_from_artwork.turned(low + Vec2{kSide / 2, kSide / 2});
      burn_piece(laser, fmt::format("A{}-{}", row + 1, column + 1), low, sheet_from_artwork);
    }
    laser.send("M5");
    laser.drain();
    job_.width_mm = columns * kSide;
    job_.height_mm = rows * kSide;
    log_ = laser.log();
    laser_seconds_ = laser.seconds();
    world_->flush_burns();
    EXPECT_TRUE(world_->lift(sim::Spot::kBed).ok());
  }

  Claims claims() {
    Claims claims;
    ClaimedPanel panel;
    panel.id = "P-0001";
    for (const sim::TrueTag& tag : sheet_->tags) {
      panel.tags.push_back(tag.id);
      panel.fiducials.push_back({true, tag.id, (tag.corners[0] + tag.corners[2]) * 0.5});
    }
    claims.panels.push_back(panel);
    const Vec2 o = pose_.place({0, 0});
    const Vec2 u = pose_.place({1, 0}) - o;
    const Vec2 v = pose_.place({0, 1}) - o;
    claims.poses.emplace(1, ClaimedPose{"P-0001", 0, u.x, v.x, u.y, v.y, o});
    paint_preview();
    claims.ledger = ledger_;
    claims.jobs.emplace(1, job_);
    return claims;
  }

  sim::BeamLog log_;
  double laser_seconds_ = 0;

 private:
  static Ring square(Vec2 low, double by) {
    return {{low.x - by, low.y - by},
            {low.x + kSide + by, low.y - by},
            {low.x + kSide + by, low.y + kSide + by},
            {low.x - by, low.y + kSide + by}};
  }

  // Sheet mm -> what must be commanded for the beam to be there, in the controller's machine coordinates.
  Vec2 wire(Vec2 on_sheet) const {
    const Vec2 bed = pose_.place(on_sheet);
    const sim::MachineAxes axes = world_->axes();
    const double y = bed.y / (1 + axes.y_scale);
    return {(bed.x - axes.skew * y) / (1 + axes.x_scale) - 520, y - 380};
  }

  void burn_path(Streamer& laser, const Ring& path, double feed, int power) const {
    const Vec2 start = wire(path.front());
    laser.send(fmt::format("G0X{:.3f}Y{:.3f}", start.x, start.y));
    laser.send(fmt::format("G1F{:.0f}S{}", feed * 60, power));
    for (std::size_t i = 1; i < path.size(); ++i) {
      const int parts = std::max(1, static_cast<int>(sim::length(path[i] - path[i - 1]) / 4));
      for (int k = 1; k <= parts; ++k) {
        const Vec2 to = wire(path[i - 1] + (path[i] - path[i - 1]) * (static_cast<double>(k) / parts));
        laser.send(fmt::format("X{:.3f}Y{:.3f}", to.x, to.y));
      }
    }
  }

  void burn_piece(Streamer& laser, const std::string& mark, Vec2 low, const Rigid& sheet_from_artwork) {
    const auto placed = [&](Ring ring) {
      for (Vec2& p : ring) p = sheet_from_artwork(p);
      return ring;
    };
    for (sim::Stroke stroke : sim::stroke_text(mark, 2.4, 0.5)) {
      for (Vec2& p : stroke) p = low + Vec2{kSide / 2 + 4.5 - p.x, kSide / 2 - 1 + p.y};
      burn_path(laser, placed(stroke), 80, 200);
    }
    const double kerf = world_->truth().kerf_mm;
    Ring path = placed(square(low, kerf / 2));
    path.push_back(path.front());
    burn_path(laser, path, 15, 850);
    ClaimedPiece piece{mark, "P-0001", "cut", square(low, 0), placed(square(low, 0))};
    ledger_.push_back({"P-0001", mark, "cut", 1, piece.panel_outline, {placed(square(low, kerf))}});
    moves_.push_back(sheet_from_artwork);
    job_.pieces.push_back(std::move(piece));
  }

  void paint_preview() {
    constexpr double kPxPerMm = 300 / 25.4;
    cv::Mat picture(static_cast<int>(std::lround(job_.height_mm * kPxPerMm)),
                    static_cast<int>(std::lround(job_.width_mm * kPxPerMm)), CV_8UC3);
    const int columns = static_cast<int>(std::lround(job_.width_mm / kSide));
    const int rows = static_cast<int>(std::lround(job_.height_mm / kSide));
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        const Vec2 at{(x + 0.5) / kPxPerMm, job_.height_mm - (y + 0.5) / kPxPerMm};
        const int row = rows - 1 - std::clamp(static_cast<int>(at.y / kSide), 0, rows - 1);
        const int column = std::clamp(static_cast<int>(at.x / kSide), 0, columns - 1);
        const Vec2 px = sheet_->pixel(moves_[static_cast<std::size_t>(row * columns + column)](at));
        picture.at<cv::Vec3b>(y, x) = sheet_->front.at<cv::Vec3b>(static_cast<int>(px.y), static_cast<int>(px.x));
      }
    cv::GaussianBlur(picture, picture, {0, 0}, 0.7);
    job_.preview_file = dir_ / "preview.png";
    job_.job = 1;
    cv::imwrite(job_.preview_file.string(), picture);
  }

  std::filesystem::path dir_;
  std::unique_ptr<sim::World> world_;
  sim::SheetPose pose_;
  std::shared_ptr<const sim::Sheet> sheet_;
  ClaimedJob job_;
  std::vector<ClaimedAllocation> ledger_;
  std::vector<Rigid> moves_;
};

double seconds_since(std::chrono::steady_clock::time_point from) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
}

TEST(ProofOfTheTwin, IsGreenOverAPanelCutThroughTheController) {
  const bool large = std::getenv("VENEER_PROOF_LARGE") != nullptr;  // NOLINT(concurrency-mt-unsafe)
  const std::filesystem::path dir = std::filesystem::path(::testing::TempDir()) / "veneer-proof-test" / "twin";
  const auto begin = std::chrono::steady_clock::now();
  TwinRun run(dir, large ? 420 : 200, large ? 280 : 160);
  const double made = seconds_since(begin);
  run.cut();
  const double cut = seconds_since(begin) - made;
  EXPECT_EQ(run.log_.beam_at_rest_s, 0);
  EXPECT_EQ(run.log_.lost_bytes, 0U);
  const Claims claims = run.claims();
  const auto before = std::chrono::steady_clock::now();
  const auto truth = load_truth(dir, claims);
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  const double loaded = seconds_since(before);
  const auto proof = prove(*truth, claims, 2);
  ASSERT_TRUE(proof.ok()) << proof.error().message;
  const double proven = seconds_since(before) - loaded;
  const JobProof& job = proof->jobs.at(0);
  fmt::print(
      "{} pieces: panel made in {:.1f} s, cut in {:.1f} s ({:.0f} s of device time), read in {:.1f} s, proven in "
      "{:.1f} s; edge {:.3f} / {:.3f} mm, ssim {:.4f} ({:.4f} with joints filled), {} fiducials\n",
      job.pieces, made, cut, run.laser_seconds_, loaded, proven, job.edge.rms, job.edge.max,
      job.picture_ssim.value_or(0), job.picture_ssim_joints_filled.value_or(0), claims.panels[0].fiducials.size());
  EXPECT_EQ(job.cut, job.pieces);
  EXPECT_EQ(job.unreadable_ids, 0U) << ::testing::PrintToString(job.notes);
  EXPECT_EQ(job.wrong_pieces, 0U) << ::testing::PrintToString(job.notes);
  EXPECT_EQ(job.mirrored_pieces, 0U) << ::testing::PrintToString(job.notes);
  EXPECT_LT(job.edge.rms, 0.02);
  EXPECT_GT(*job.picture_ssim, 0.9);
  EXPECT_GT(*job.picture_ssim_joints_filled, 0.95);
  EXPECT_TRUE(*proof->ledger_matches.at(0)) << ::testing::PrintToString(proof->notes);
  EXPECT_LT(proof->poses.at(0).pose->rms, 1e-6);
  ASSERT_TRUE(write_proof(*proof, dir / "out").ok());
}

// A scan shows a hair where the wood has none, and with it the preview of the piece planned there. Told by what the
// twin knows to have lain on the glass; without that knowledge the right piece would be taken for another.
TEST(ProofOfTheTwin, KnowsTheHairThatAPreviewShows) {
  const std::filesystem::path dir = std::filesystem::path(::testing::TempDir()) / "veneer-proof-test" / "hair";
  TwinRun run(dir, 200, 160);
  run.cut();
  Claims claims = run.claims();
  auto truth = load_truth(dir, claims);
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  claims.panels[0].registration.push_back({"capture-1", {}, 0, 0, 0, {}});
  sim::ScanTruth& scan = truth->captures["capture-1"];
  scan.sheet = "wood", scan.px_per_mm = 300 / 25.4;

  const ClaimedJob& job = claims.jobs->at(0);
  cv::Mat preview = cv::imread(job.preview_file.string());
  const double px_per_mm = preview.cols / job.width_mm;
  const auto pixel = [&](Vec2 p) { return cv::Point2d(p.x * px_per_mm, (job.height_mm - p.y) * px_per_mm); };
  for (const ClaimedPiece& piece : job.pieces)
    for (int k = 0; k < 3; ++k) {
      const auto end = [&](const Ring& ring, double v) {
        return ring[0] + (ring[1] - ring[0]) * (0.1 + 0.1 * k) + (ring[3] - ring[0]) * v;
      };
      cv::line(preview, pixel(end(piece.artwork_outline, 0.1)), pixel(end(piece.artwork_outline, 0.9)),
               cv::Scalar(230, 230, 230), 4, cv::LINE_AA);
      const Ring& wood = piece.panel_outline;
      scan.dust.push_back({{scan.scan_pixel(end(wood, 0.1)), scan.scan_pixel(end(wood, 0.9))}, 2});
    }
  ASSERT_TRUE(cv::imwrite(job.preview_file.string(), preview));

  const auto proof = prove(*truth, claims, 2);
  ASSERT_TRUE(proof.ok()) << proof.error().message;
  EXPECT_EQ(proof->jobs.at(0).wrong_pieces, 0U) << ::testing::PrintToString(proof->jobs.at(0).notes);
  EXPECT_EQ(proof->jobs.at(0).pieces_under_dust, job.pieces.size());
  scan.dust.clear();
  const auto unknowing = prove(*truth, claims, 2);
  ASSERT_TRUE(unknowing.ok()) << unknowing.error().message;
  EXPECT_GT(unknowing->jobs.at(0).wrong_pieces, 0U);
}

}  // namespace
}  // namespace veneer::proof
