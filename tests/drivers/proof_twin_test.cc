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
#include "drivers/sim/roughness.h"
#include "drivers/sim/world.h"
#include "tests/support/stroke_font.h"

namespace veneer::proof {
namespace {

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
  // `side` of the pieces, which are squares; `rough`: how unkind the workshop is.
  TwinRun(std::filesystem::path dir, double width, double height, double side = 14, const sim::Roughness& rough = {})
      : dir_(std::move(dir)), side_(side) {
    std::filesystem::remove_all(dir_);
    std::filesystem::create_directories(dir_);
    sim::TwinSettings settings;
    settings.seed = 5;
    settings.sheet_dpi = 300;
    settings.rough = rough;
    world_ = std::move(*sim::World::open(settings, dir_, make_null_logger()));
    EXPECT_TRUE(world_->new_panel("wood", width, height, 0).ok());
    EXPECT_TRUE(world_->place("wood", sim::Spot::kBed, sim::SheetFace::kBack, "whole", 0).ok());
    const auto placed = world_->snapshot(sim::Spot::kBed);
    pose_ = placed->placement.pose;
    sheet_ = placed->sheet;
  }

  // Cuts pieces on a square pitch over the veneer, turned by multiples of 24 degrees. `marks`: in reading order, of a
  // height; none: those that tell places.
  void cut(const std::vector<std::string>& marks = {}, double mark_height = 2.4) {
    mark_height_ = mark_height;
    Streamer laser(*world_);
    laser.send("G21 G90 M4 S0");
    const int columns = static_cast<int>((sheet_->width_mm - 60) / kPitch);
    const int rows = static_cast<int>((sheet_->height_mm - 60) / kPitch);
    for (int i = 0; i < columns * rows; ++i) {
      Rigid sheet_from_artwork = Rigid::turn((i % 15) * 24 * 0.017453292519943295);
      const int column = i % columns, row = i / columns;
      const Vec2 low{column * side_, (rows - 1 - row) * side_};
      const Vec2 at{30 + kPitch * (column + 0.5), 30 + kPitch * (row + 0.5)};
      sheet_from_artwork.shift = at - sheet_from_artwork.turned(low + Vec2{side_ / 2, side_ / 2});
      const std::string place = fmt::format("A{}-{}", row + 1, column + 1);
      burn_piece(laser, marks.empty() ? place : marks.at(static_cast<std::size_t>(i)), low, sheet_from_artwork);
    }
    laser.send("M5");
    laser.drain();
    job_.width_mm = columns * side_;
    job_.height_mm = rows * side_;
    log_ = laser.log();
    laser_seconds_ = laser.seconds();
    world_->flush_burns();
    EXPECT_TRUE(world_->lift(sim::Spot::kBed).ok());
  }

  // The preview has `px_per_mm`.
  Claims claims(double px_per_mm = 300 / 25.4) {
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
    paint_preview(px_per_mm);
    claims.ledger = ledger_;
    claims.jobs.emplace(1, job_);
    return claims;
  }

  sim::BeamLog log_;
  double laser_seconds_ = 0;

 private:
  Ring square(Vec2 low, double by) const {
    return {{low.x - by, low.y - by},
            {low.x + side_ + by, low.y - by},
            {low.x + side_ + by, low.y + side_ + by},
            {low.x - by, low.y + side_ + by}};
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
    for (sim::Stroke stroke : sim::stroke_text(mark, mark_height_, mark_height_ * 0.21)) {
      for (Vec2& p : stroke) p = low + Vec2{side_ / 2 + 4.5 - p.x, side_ / 2 - 1 + p.y};
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

  void paint_preview(double px_per_mm) {
    cv::Mat picture(static_cast<int>(std::lround(job_.height_mm * px_per_mm)),
                    static_cast<int>(std::lround(job_.width_mm * px_per_mm)), CV_8UC3);
    const int columns = static_cast<int>(std::lround(job_.width_mm / side_));
    const int rows = static_cast<int>(std::lround(job_.height_mm / side_));
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        const Vec2 at{(x + 0.5) / px_per_mm, job_.height_mm - (y + 0.5) / px_per_mm};
        const int row = rows - 1 - std::clamp(static_cast<int>(at.y / side_), 0, rows - 1);
        const int column = std::clamp(static_cast<int>(at.x / side_), 0, columns - 1);
        const Vec2 px = sheet_->pixel(moves_[static_cast<std::size_t>(row * columns + column)](at));
        picture.at<cv::Vec3b>(y, x) = sheet_->front.at<cv::Vec3b>(static_cast<int>(px.y), static_cast<int>(px.x));
      }
    cv::GaussianBlur(picture, picture, {0, 0}, 0.7);
    job_.preview_file = dir_ / "preview.png";
    job_.preview_px_per_mm = px_per_mm;
    job_.job = 1;
    cv::imwrite(job_.preview_file.string(), picture);
  }

  std::filesystem::path dir_;
  double side_;  // mm
  double mark_height_ = 2.4;
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

// Small short marks, burnt by a machine as workshops have it: the proof knows by their form that they are short, and
// reads all.
TEST(ProofOfTheTwin, ReadsShortMarksThatAWorkshopBurnt) {
  const std::filesystem::path dir = std::filesystem::path(::testing::TempDir()) / "veneer-proof-test" / "short";
  TwinRun run(dir, 200, 160, 14, *sim::roughness_preset("workshop"));
  const std::string signs = "12345678ACDEFHKLMNPRUVWXY";
  std::vector<std::string> marks;
  for (std::size_t i = 0; i < 60; ++i) marks.push_back({signs[i % 25], signs[i * 7 % 25], "123567CDEFKLPR"[i % 14]});
  run.cut(marks, 1.5);
  const Claims claims = run.claims();
  const auto truth = load_truth(dir, claims);
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  const auto proof = prove(*truth, claims, 2);
  ASSERT_TRUE(proof.ok()) << proof.error().message;
  const JobProof& job = proof->jobs.at(0);
  EXPECT_GE(job.pieces, 20U);
  EXPECT_EQ(job.unreadable_ids, 0U) << ::testing::PrintToString(job.notes);
  EXPECT_EQ(job.wrong_pieces, 0U) << ::testing::PrintToString(job.notes);
  EXPECT_EQ(job.mirrored_pieces, 0U) << ::testing::PrintToString(job.notes);
}

// A panel cut into pieces, and scanned with hairs on the glass.
struct Haired {
  static constexpr double kBlock = 2;  // mm
  Claims claims;
  Truth truth;
  sim::ScanTruth* scan = nullptr;
  std::shared_ptr<sim::Sheet> sheet;
  cv::Mat preview;
  int blocks;  // in each direction of a piece

  explicit Haired(const std::string& name, double width = 200, double height = 160, double px_per_mm = 300 / 25.4,
                  double side = 14)
      : blocks(static_cast<int>(side / kBlock)) {
    const auto dir = std::filesystem::path(::testing::TempDir()) / "veneer-proof-test" / name;
    TwinRun run(dir, width, height, side);
    run.cut();
    claims = run.claims(px_per_mm);
    auto loaded = load_truth(dir, claims);
    EXPECT_TRUE(loaded.ok()) << loaded.error().message;
    truth = std::move(*loaded);
    sheet = std::make_shared<sim::Sheet>(*truth.sheets.at("wood"));
    truth.sheets["wood"] = sheet;
    claims.panels[0].registration.push_back({"capture-1", {}, 0, 0, 0, {}});
    scan = &truth.captures["capture-1"];
    scan->sheet = "wood", scan->px_per_mm = 300 / 25.4;
    preview = cv::imread(job().preview_file.string());
  }
  const ClaimedJob& job() const { return claims.jobs->at(0); }
  // A place in a piece, as shares of its sides.
  static Vec2 in(const Ring& ring, double u, double v) {
    return ring[0] + (ring[1] - ring[0]) * u + (ring[3] - ring[0]) * v;
  }
  cv::Point2d on_preview(Vec2 p) const {
    return {p.x * job().preview_px_per_mm, (job().height_mm - p.y) * job().preview_px_per_mm};
  }
  cv::Point2d on_sheet(Vec2 p) const {
    const Vec2 px = sheet->pixel(p);
    return {px.x, px.y};
  }
  // Upright in the piece, which the preview shows and the wood has not.
  void add_hair(const ClaimedPiece& piece, double u) {
    cv::line(preview, on_preview(in(piece.artwork_outline, u, 0.1)), on_preview(in(piece.artwork_outline, u, 0.9)),
             cv::Scalar(230, 230, 230), 4, cv::LINE_AA);
    const Ring& wood = piece.panel_outline;
    scan->dust.push_back({{scan->scan_pixel(in(wood, u, 0.1)), scan->scan_pixel(in(wood, u, 0.9))}, 2});
  }
  // Makes the wood of a piece plain: each block is by up to `grain` levels lighter or darker than `grey`.
  void make_plain(const ClaimedPiece& piece, int grey, int grain, cv::RNG& draw) {
    for (int i = 0; i < blocks; ++i)
      for (int k = 0; k < blocks; ++k) {
        const cv::Scalar colour = cv::Scalar::all(draw.uniform(grey - grain, grey + grain + 1));
        const auto corner = [&](const Ring& ring, int u, int v) {
          return in(ring, (i + u) / double(blocks), (k + v) / double(blocks));
        };
        // A pixel shows the block that its middle lies in.
        const cv::Point2d left_low = on_preview(corner(piece.artwork_outline, 0, 0));
        const cv::Point2d right_high = on_preview(corner(piece.artwork_outline, 1, 1));
        const auto first = [](double at) { return static_cast<int>(std::ceil(at - 0.5)); };
        const cv::Rect shown(cv::Point(first(left_low.x), first(right_high.y)),
                             cv::Point(first(right_high.x), first(left_low.y)));
        preview(shown & cv::Rect({}, preview.size())).setTo(colour);
        std::vector<cv::Point> wood;
        for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
          wood.emplace_back(on_sheet(corner(piece.panel_outline, u, v)));
        cv::fillConvexPoly(sheet->front, wood, colour);
      }
  }
  JobProof proven() const {
    EXPECT_TRUE(cv::imwrite(job().preview_file.string(), preview));
    auto proof = prove(truth, claims, 2);
    EXPECT_TRUE(proof.ok()) << proof.error().message;
    return proof.ok() ? proof->jobs.at(0) : JobProof{};
  }
};

// A scan shows a hair where the wood has none, and with it the preview of the piece planned there. Told by what the
// twin knows to have lain on the glass; without that knowledge right pieces would be taken for others, in grey.
TEST(ProofOfTheTwin, KnowsTheHairThatAPreviewShows) {
  Haired it("hair");
  for (const ClaimedPiece& piece : it.job().pieces)
    for (int k = 0; k < 3; ++k) it.add_hair(piece, 0.1 + 0.1 * k);
  const JobProof proof = it.proven();
  EXPECT_EQ(proof.wrong_pieces, 0U) << ::testing::PrintToString(proof.notes);
  EXPECT_EQ(proof.pieces_under_dust, it.job().pieces.size());
  EXPECT_EQ(proof.wrong_by_correlation, 0U);
  it.scan->dust.clear();
  EXPECT_GT(it.proven().wrong_by_correlation, 0U);
}

// What a hair hides of a preview is not looked at in the piece either: plain pieces differ by less than a streak that
// lies under the hair.
TEST(ProofOfTheTwin, LooksAtAPieceOnlyWhereItsPreviewShowsWood) {
  Haired it("streaks");
  cv::RNG draw(7);
  for (const ClaimedPiece& piece : it.job().pieces) {
    it.make_plain(piece, 60, 4, draw);
    for (int i = 0; i < it.blocks; ++i) {
      const double u = (i + 0.5) / it.blocks;
      it.add_hair(piece, u);
      cv::line(it.sheet->front, it.on_sheet(Haired::in(piece.panel_outline, u, 0.1)),
               it.on_sheet(Haired::in(piece.panel_outline, u, 0.9)), cv::Scalar::all(draw.uniform(0, 120)), 4);
    }
  }
  const JobProof proof = it.proven();
  EXPECT_EQ(proof.pieces_under_dust, it.job().pieces.size());
  EXPECT_EQ(proof.wrong_pieces, 0U) << ::testing::PrintToString(proof.notes);
}

TEST(ProofOfTheTwin, FindsWrongAndMirroredPiecesUnderHairsToo) {
  Haired it("swapped");
  cv::RNG draw(7);
  for (const ClaimedPiece& piece : it.job().pieces) it.make_plain(piece, 60, 4, draw);
  // Two previews show each other's wood, and one shows its own in a mirror.
  const auto shown = [&](std::size_t i) {
    const cv::Point corner = it.on_preview(it.job().pieces[i].artwork_outline[3]);
    const int side = static_cast<int>(14 * it.job().preview_px_per_mm);
    return cv::Mat(it.preview, cv::Rect(corner, cv::Size(side, side)));
  };
  const cv::Mat first = shown(0).clone();
  cv::Mat at = shown(0);
  shown(7).copyTo(at);
  at = shown(7);
  first.copyTo(at);
  at = shown(4);
  cv::flip(at.clone(), at, 1);
  for (const ClaimedPiece& piece : it.job().pieces)
    for (int k = 0; k < 3; ++k) it.add_hair(piece, 0.25 + 0.25 * k);
  const JobProof proof = it.proven();
  EXPECT_EQ(proof.pieces_under_dust, it.job().pieces.size());
  EXPECT_EQ(proof.wrong_pieces, 2U) << ::testing::PrintToString(proof.notes);
  EXPECT_EQ(proof.mirrored_pieces, 1U) << ::testing::PrintToString(proof.notes);
}

// An artwork is seldom whole pixels wide. Were the preview's resolution taken from its width, an upright one's lower
// pieces would be looked for by a pixel beside where it shows them, and a row of a pale neighbour's pixels is more than
// plain wood differs by.
TEST(ProofOfTheTwin, FindsPiecesFarFromTheCornerThatAPreviewsPixelsCountFrom) {
  constexpr int kColumns = 5;
  constexpr double kSide = 12;  // whole blocks on either side of the middle
  Haired it("corner", 180, 260, 708.49 / (kColumns * kSide), kSide);
  cv::RNG draw(11);
  int i = 0;
  for (const ClaimedPiece& piece : it.job().pieces) {
    const int row = i / kColumns, column = i % kColumns;
    it.make_plain(piece, (row + column) % 2 == 0 ? 40 : 240, 1, draw);
    ++i;
  }
  ASSERT_EQ(it.preview.cols, 708);
  const JobProof proof = it.proven();
  EXPECT_EQ(proof.wrong_pieces, 0U) << ::testing::PrintToString(proof.notes);
  // A resolution that cannot be the preview's is not believed: its width tells about as well.
  for (const double told : {0.0, 150 / 25.4}) {
    it.claims.jobs->at(0).preview_px_per_mm = told;
    EXPECT_GT(it.proven().picture_ssim.value_or(0), 0.9) << told;
  }
}

}  // namespace
}  // namespace veneer::proof
