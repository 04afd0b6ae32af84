// A small made-up truth and what a faultless cell would claim of it, for testing the proof itself. Every fault that the
// proof must see can be injected alone.
#pragma once

#include <cmath>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "drivers/sim/proof/proof.h"
#include "tests/support/stroke_font.h"

namespace veneer::proof {

struct SceneFaults {
  double lattice_shift_px = 0;
  double pose_shift_mm = 0;
  double scale = 1;             // of all that the cell measures
  double kerf_offset_mm = 0;    // cuts lie this much too far in
  bool swap_marks = false;      // of the first two pieces
  bool mirror_mark = false;     // of the first piece
  bool mirror_picture = false;  // the first piece was cut from a mirrored face
  bool no_mark = false;         // on the first piece
  bool delete_ledger_row = false;
  bool lease_ledger_row = false;
  bool book_twice = false;      // the last piece's wood, for a piece of another job
  bool forget_capture = false;  // the scan that the cell claims was never taken
  bool forget_piece = false;    // the last piece, by the job and the ledger
  bool lost_piece = false;      // the last piece is in the ledger only
  bool skip_cut = false;        // the last piece was booked but never cut
  double browned_mm = 0;        // of the show face beside each cut
  bool screw_hole = false;      // in the first piece, of the panel that it was cut from
  bool holes_at_sides = false;  // a screw's and one through the sheet bite the first two pieces and graze two others
  bool quarter_turned_mark = false;  // on the first piece, engraved so for want of room
};

class ProofScene {
 public:
  static constexpr int kColumns = 2, kRows = 2;
  static constexpr double kPieceX = 12, kPieceY = 13, kKerf = 0.27;

  ProofScene(const SceneFaults& faults, std::filesystem::path dir) : faults_(faults), dir_(std::move(dir)) {
    std::filesystem::create_directories(dir_);
    make_sheet();
    claim_panel();
    make_pieces();
    paint_preview();
    claim_pose();
    truth.sheets["wood"] = sheet_;
  }

  Truth truth;
  Claims claims;

 private:
  struct Piece {
    std::string mark;
    Ring artwork;
    Rigid sheet_from_artwork;
  };

  Vec2 claimed(Vec2 sheet) const { return panel_from_sheet_(sheet) * faults_.scale; }
  Ring claimed(const Ring& ring) const {
    Ring out;
    for (const Vec2& p : ring) out.push_back(claimed(p));
    return out;
  }

  void make_sheet() {
    sheet_ = std::make_shared<sim::Sheet>();
    sheet_->name = "wood";
    sheet_->width_mm = 130;
    sheet_->height_mm = 110;
    sheet_->thickness_mm = 2.1;
    sheet_->px_per_mm = 8;
    const cv::Size size(1040, 880);
    cv::RNG random(11);
    cv::Mat grain(size, CV_32FC3);
    random.fill(grain, cv::RNG::NORMAL, 0, 1000);
    cv::GaussianBlur(grain, grain, {0, 0}, 9, 14);
    cv::Mat fine(size, CV_32FC3);
    random.fill(fine, cv::RNG::NORMAL, 0, 8);
    grain += fine + cv::Scalar(70, 110, 150);
    grain.convertTo(sheet_->front, CV_8U);
    cv::Mat ply(size, CV_32FC3);
    random.fill(ply, cv::RNG::NORMAL, 0, 6);
    ply += cv::Scalar(170, 200, 215);
    ply.convertTo(sheet_->back, CV_8U);
    sheet_->engraved_front = cv::Mat::zeros(size, CV_8UC1);
    const Vec2 places[] = {{12, 12}, {118, 14}, {60, 11}, {13, 98}, {116, 97}, {86, 99}};
    int id = 200;
    for (const Vec2& p : places) {
      sim::TrueTag tag;
      tag.id = id++;
      tag.corners = {p + Vec2{-7, -7}, p + Vec2{7, -7}, p + Vec2{7, 7}, p + Vec2{-7, 7}};
      sheet_->tags.push_back(tag);
    }
    sheet_->holes = {{{30, 8}, 6}, {{100, 8}, 6}, {{40, 102}, 6}};
    sheet_->screw_holes = {{{100, 50}, 4.5}};  // beside the pieces
  }

  void claim_panel() {
    panel_from_sheet_ = Rigid::turn(0.004);
    panel_from_sheet_.shift = {1.5, -0.7};
    ClaimedPanel panel;
    panel.id = "P-0001";
    for (const sim::TrueTag& tag : sheet_->tags) {
      panel.tags.push_back(tag.id);
      panel.fiducials.push_back({true, tag.id, claimed((tag.corners[0] + tag.corners[2]) * 0.5)});
    }
    for (const sim::TrueHole& hole : sheet_->holes) panel.fiducials.push_back({false, -1, claimed(hole.centre)});
    sim::ScanTruth scan;
    scan.capture = "capture-1";
    scan.sheet = "wood";
    scan.glass_from_sheet = {0.01, false, {90, 70}};
    scan.px_per_mm = 300 / 25.4;
    scan.scanner = sim::draw_cell_truth({}).scanner;
    if (!faults_.forget_capture) truth.captures["capture-1"] = scan;
    ClaimedLattice lattice;
    lattice.capture = "capture-1";
    lattice.origin_px = {0, 0};
    lattice.step_px = 32;
    lattice.columns = 118;
    lattice.rows = 111;
    for (int r = 0; r < lattice.rows; ++r)
      for (int c = 0; c < lattice.columns; ++c)
        lattice.panel.push_back(claimed(scan.sheet_mm({c * 32.0 + faults_.lattice_shift_px, r * 32.0})));
    panel.registration.push_back(std::move(lattice));
    claims.panels.push_back(std::move(panel));
  }

  void burn(sim::BurnDepth depth, double width, std::vector<Vec2> points) const {
    sheet_->burns.push_back({depth, sim::SheetFace::kBack, width, 0, 0, std::move(points)});
  }

  void make_pieces() {
    ClaimedJob job;
    job.job = 7;
    job.width_mm = kColumns * kPieceX;
    job.height_mm = kRows * kPieceY;
    claims.ledger.emplace();
    for (int i = 0; i < kColumns * kRows; ++i) {
      Piece piece;
      const int row = i / kColumns;
      const int column = i % kColumns;
      piece.mark = "A" + std::to_string(row + 1) + "-" + std::to_string(column + 9);
      const Vec2 low{column * kPieceX, (kRows - 1 - row) * kPieceY};
      piece.artwork = grown(low, low + Vec2{kPieceX, kPieceY}, 0);
      piece.sheet_from_artwork = Rigid::turn(i * 24 * 0.017453292519943295);
      const Vec2 centre = piece.sheet_from_artwork.turned(low + Vec2{kPieceX / 2, kPieceY / 2});
      piece.sheet_from_artwork.shift = Vec2{32.0 + 28 * column, 40.0 + 28 * row} - centre;
      pieces_.push_back(piece);
    }
    if (faults_.screw_hole) {
      // It reaches into the piece with a part of it only.
      const Vec2 corner = pieces_[0].sheet_from_artwork(pieces_[0].artwork[0]);
      sheet_->screw_holes.push_back({corner + Vec2{-0.5, -0.5}, 4.5});
    }
    if (faults_.holes_at_sides) {
      constexpr double kBite = 0.12, kGraze = 0.02;
      sheet_->screw_holes.push_back(beside(0, 4.5, kBite)), sheet_->holes.push_back(beside(1, 6, kBite));
      sheet_->screw_holes.push_back(beside(2, 4.5, kGraze)), sheet_->holes.push_back(beside(3, 6, kGraze));
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      cut(i);
      engrave(i);
      claim(i, job);
    }
    if (faults_.delete_ledger_row || faults_.forget_piece) claims.ledger->pop_back();
    if (faults_.lease_ledger_row) claims.ledger->back().state = "leased";
    if (faults_.forget_piece || faults_.lost_piece) job.pieces.pop_back();
    if (faults_.book_twice) {
      claims.ledger->push_back(claims.ledger->back());
      claims.ledger->back().job = job.job + 1;
    }
    claims.jobs.emplace();
    claims.jobs->push_back(std::move(job));
  }

  // A hole beside the middle of a piece's side, which reaches into the piece by `bite`.
  sim::TrueHole beside(std::size_t piece, double diameter, double bite) const {
    const Piece& at = pieces_[piece];
    const Vec2 middle = (at.artwork[0] + at.artwork[1]) * 0.5;
    return {at.sheet_from_artwork(middle + Vec2{0, bite - diameter / 2}), diameter};
  }

  static Ring grown(Vec2 low, Vec2 high, double by) {
    return {{low.x - by, low.y - by}, {high.x + by, low.y - by}, {high.x + by, high.y + by}, {low.x - by, high.y + by}};
  }
  static Ring placed(const Ring& ring, const Rigid& move) {
    Ring out;
    for (const Vec2& p : ring) out.push_back(move(p));
    return out;
  }

  void cut(std::size_t i) const {
    if (faults_.skip_cut && i + 1 == pieces_.size()) return;
    const Piece& piece = pieces_[i];
    Ring path =
        placed(grown(piece.artwork[0], piece.artwork[2], kKerf / 2 - faults_.kerf_offset_mm), piece.sheet_from_artwork);
    path.push_back(path.front());
    for (std::size_t k = 1; k < path.size() && faults_.browned_mm > 0; ++k) {
      const Vec2 a = sheet_->pixel(path[k - 1]), b = sheet_->pixel(path[k]);
      cv::line(sheet_->engraved_front, cv::Point2d(a.x, a.y), cv::Point2d(b.x, b.y), cv::Scalar(95),
               static_cast<int>(std::lround((kKerf + 2 * faults_.browned_mm) * sheet_->px_per_mm)));
    }
    burn(sim::BurnDepth::kThrough, kKerf, path);
  }

  void engrave(std::size_t i) const {
    if (faults_.no_mark && i == 0) return;
    const Piece& piece = pieces_[i];
    const std::size_t other = faults_.swap_marks && i < 2 ? 1 - i : i;
    for (sim::Stroke stroke : sim::stroke_text(pieces_[other].mark, 2.2, 0.45)) {
      for (Vec2& p : stroke) {
        p = p - Vec2{4.2, 1};
        if (faults_.quarter_turned_mark && i == 0) p = {-p.y, p.x};
        if (!(faults_.mirror_mark && i == 0)) p.x = -p.x;  // seen from behind it reads right
        p = piece.sheet_from_artwork((piece.artwork[0] + piece.artwork[2]) * 0.5 + p);
      }
      burn(sim::BurnDepth::kEngrave, 0.2, std::move(stroke));
    }
  }

  void claim(std::size_t i, ClaimedJob& job) {
    const Piece& piece = pieces_[i];
    ClaimedPiece said;
    said.mark = piece.mark;
    said.panel = "P-0001";
    said.state = "cut";
    said.artwork_outline = piece.artwork;
    said.panel_outline = claimed(placed(piece.artwork, piece.sheet_from_artwork));
    ClaimedAllocation row;
    row.panel = said.panel;
    row.mark = said.mark;
    row.state = "cut";
    row.job = job.job;
    row.outline = said.panel_outline;
    row.allocation = {claimed(placed(grown(piece.artwork[0], piece.artwork[2], kKerf), piece.sheet_from_artwork))};
    claims.ledger->push_back(row);
    job.pieces.push_back(std::move(said));
  }

  // What the planner would show: the wood of each piece in its patch, as a scan with its own light saw it.
  void paint_preview() {
    constexpr double kPxPerMm = 10;
    ClaimedJob& job = claims.jobs->front();
    cv::Mat picture(static_cast<int>(job.height_mm * kPxPerMm), static_cast<int>(job.width_mm * kPxPerMm), CV_8UC3);
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        Vec2 at{(x + 0.5) / kPxPerMm, job.height_mm - (y + 0.5) / kPxPerMm};
        const std::size_t i = static_cast<std::size_t>(kRows - 1 - static_cast<int>(at.y / kPieceY)) * kColumns +
                              static_cast<std::size_t>(at.x / kPieceX);
        if (faults_.mirror_picture && i == 0) at.x = kPieceX - at.x;
        const Vec2 px = sheet_->pixel(pieces_[i].sheet_from_artwork(at));
        const auto& wood = sheet_->front.at<cv::Vec3b>(static_cast<int>(px.y), static_cast<int>(px.x));
        for (int c = 0; c < 3; ++c)
          picture.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<unsigned char>(0.93 * wood[c] + 6);
      }
    cv::GaussianBlur(picture, picture, {0, 0}, 0.6);
    job.preview_file = dir_ / "preview.png";
    job.preview_px_per_mm = kPxPerMm;
    cv::imwrite(job.preview_file.string(), picture);
  }

  void claim_pose() {
    const sim::SheetPose lies{0.3, true, {300, 120}};
    truth.loads["wood"] = {{{1.1, true, {200, 90}}}, {lies}};
    // bed_from_panel = lies * sheet_from_panel, read off at three points
    const Rigid sheet_from_panel = panel_from_sheet_.inverse();
    const auto bed = [&](Vec2 panel) { return lies.place(sheet_from_panel(panel)); };
    const Vec2 o = bed({0, 0});
    const Vec2 u = bed({1, 0}) - o;
    const Vec2 v = bed({0, 1}) - o;
    claims.poses.emplace();
    claims.poses->push_back({"P-0001", 0, u.x, v.x, u.y, v.y, o + Vec2{faults_.pose_shift_mm, 0}});
  }

  SceneFaults faults_;
  std::filesystem::path dir_;
  std::shared_ptr<sim::Sheet> sheet_;
  Rigid panel_from_sheet_;
  std::vector<Piece> pieces_;
};

}  // namespace veneer::proof
