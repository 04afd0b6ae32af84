// A job on two panels, for tests of what becomes of it.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "db/job_store.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

inline const Isometry2<BedFrame, PanelFrame> kPose(degrees(178), point<BedFrame>(400, 300), Handedness::kImproper);

// A job of three pieces on the first panel and one on the second; one patch has found no wood.
class PlannedJob : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel(), other = cell.new_panel();
  JobStore jobs = cell.jobs();
  JobId job = must(jobs.create(
      job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", panel, 30, 10, 14),
              square_piece("A3", panel, 50, 10, 14), square_piece("A4", other, 10, 10, 14), unfilled("A5")}),
      kNow));
  std::vector<PieceRecord> pieces = must(jobs.pieces(job));

  static PlannedPatch unfilled(const std::string& mark) {
    PlannedPatch piece = square_piece(mark, {}, 0, 0, 14);
    piece.panel.reset();
    piece.panel_outline.clear();
    piece.allocation = {};
    return piece;
  }
  RunId start(const PanelId& on) { return must(jobs.start_run(job, on, kPose, 0.04_mm, kNow)); }
  void cut(int index) {
    VENEER_ASSERT_OK(jobs.mark_cutting(pieces.at(index).id, kNow));
    VENEER_ASSERT_OK(jobs.book_piece(pieces.at(index).id, kNow));
  }
  void cut_on_other() {
    const RunId run = start(other);
    cut(3);
    VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  }
  std::vector<PieceState> states() {
    std::vector<PieceState> out;
    for (const auto& piece : must(jobs.pieces(job))) out.push_back(piece.state);
    return out;
  }
  JobState state() { return must(jobs.find(job)).state; }
};

// A plan that makes these again.
inline NewPlan made_again(const std::vector<PlannedPatch>& pieces) {
  NewPlan out = job_of(pieces);
  out.plan_json = "{\"redone\":true}";
  out.preview_file = "previews/redone.png";
  return out;
}

}  // namespace veneer::db
