// Lays the real pieces where their engraved marks say, as a person at the table would, and looks at the picture.
//
// A piece is turned so that its mark stands upright when the artwork is seen from behind, its edge is then fitted to
// the patch's outline by a rigid motion. A mark may have been engraved turned by a quarter for want of room: when the
// shape refuses the upright way, the quarter turns that the shape allows are tried and the picture decides between
// them.
//
// wrong     the piece's 2 mm block means correlate better, in grey and in colour (all three channels together), with
//           the preview of another patch than with its own. Pixels of a preview that show dust on the scanner's glass,
//           as the twin recorded it, show no wood and are not counted, nor is what lies there of the piece. Beyond
//           chance: so much better that the few blocks of a small piece do not do it by themselves
//           (Rivals::other_is_nearer_than_by_chance).
// mirrored  its mark reads only in a mirror; or its outline fits only mirrored; or its block means agree better with
//           the mirrored preview of its own patch than with any preview unmirrored: in grey, both the correlation is
//           higher, by a clear margin (0.3) over its own, and the difference lower (BlockMeans::rather).
// holed     the panel truly had a screw hole, or one through it, where the piece was cut.
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "drivers/sim/proof/claims.h"
#include "drivers/sim/proof/cut_out.h"
#include "drivers/sim/proof/mark_reader.h"
#include "drivers/sim/proof/truth.h"

namespace veneer::proof {

// A real piece of a job.
struct FoundPiece {
  const sim::Sheet* sheet = nullptr;
  Rigid panel_from_sheet;
  const CutOut* cut = nullptr;
  std::optional<ReadMark> mark;        // as read from its back
  std::size_t cut_as = 0;              // the claimed piece whose place on the panel it was cut from
  std::optional<std::size_t> laid_as;  // the claimed piece that its mark names
};

// A speck (one point) or a hair that a scan shows in place of wood.
struct PanelDust {
  std::vector<Vec2> line;
  double radius_mm = 0;
};

struct JobProof {
  std::size_t pieces = 0, cut = 0, suspect = 0;
  Residual edge;
  std::size_t wrong_pieces = 0, mirrored_pieces = 0, unreadable_ids = 0;
  std::size_t wrong_beyond_chance = 0;   // of wrong_pieces; the others may be right
  std::size_t wrong_by_correlation = 0;  // in grey: of pieces of a few blocks, and so also of many that are right
  std::size_t holed_pieces = 0;          // cut where the panel has a hole, by more than the 0.05 mm that edges err
  std::size_t pieces_under_dust = 0;     // judged without the pixels that dust hid in the scans
  std::optional<double> picture_ssim;    // nothing without a preview
  std::optional<double> picture_ssim_joints_filled;
  std::vector<std::string> notes;  // one sentence for each thing that is not as it should be
  cv::Mat assembled;               // BGR, as burnt; covers the artwork at the preview's resolution; empty without one
  cv::Mat preview;
};

// Dust on the show face's scans, by panel: in the panel's millimetres.
using DustOnPanels = std::map<std::string, std::vector<PanelDust>>;
DustOnPanels dust_on_panels(const std::vector<Tie>& ties, const Truth& truth);

JobProof prove_job(const ClaimedJob& job, const std::vector<FoundPiece>& found, const DustOnPanels& dust, int threads);

}  // namespace veneer::proof
