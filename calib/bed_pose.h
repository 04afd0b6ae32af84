// Which panel lies on the bed, which face looks up, and where: bed_from_panel, from the tags the bed camera sees.
//
// Nothing is assumed of the face: a proper and an improper isometry are both fitted, and the tags' layout must decide
// clearly. A panel with its back up has an improper one. Height is the distance of the *upper face* from the bed (the
// panel's thickness, plus what it lies on); a wrong one shows up as a scale and is refused. A panel that is thicker or
// bowed by a few tenths of a millimetre is laid where it really is.
// A tag that has moved since it was scanned is found by what the others say, named, and left out.
// Functions are pure and may run at the same time.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "base/result.h"
#include "calib/camera_model.h"
#include "calib/fiducials.h"
#include "calib/tag_detector.h"

namespace veneer::calib {

struct PanelCandidate {
  PanelId panel;
  PanelFiducials fiducials;
};

struct BedPose {
  PanelId panel;
  Face face_up = Face::kBack;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;  // its handedness is measured
  Millimetres rms{0}, max{0};                      // over the tags' corners, on the bed, as if it lay flat and as high
  Millimetres other_hand_rms{0};                   // of the isometry of the other handedness: far worse
  double scale = 1;                                // seen size over known size; the height's own check
  std::vector<int> tags;                           // ids used, ascending
  // Tags that the others put elsewhere than they are seen, by how far; they count for nothing above. How far the
  // others lie from where the rest puts them, as far as anybody can tell.
  std::vector<FiducialOffset> moved, left_out;
  // By how much those that count disagree, where that is more than a tag may be off: one of them has moved, or the
  // panel is bent, and nobody can tell which.
  std::optional<Millimetres> disagreement;
};

struct BedPoseLimits {
  Millimetres max_rms{0.10};
  Millimetres max_single{0.30};
  int min_tags = 3;
  double max_scale_error = 0.002;
  // A tag that lies farther from where the others put it has moved, and is dropped when the rest agree. Where nobody
  // can tell which one it is, they may disagree by so much.
  Millimetres max_tag_offset{0.08}, max_disagreement{0.16};
  // The other handedness must fit this much worse, and by this much in all.
  double min_hand_ratio = 10;
  Millimetres min_other_hand_rms{1};
};

// kNotFound: no tags of a known panel. kRefused: tags of several panels or both faces, strange tags among them, too
// few, too large a residual, tags of which one has moved and too few to tell which, an undecided or contradicting
// handedness.
Result<BedPose> locate_panel(std::span<const Tag<CameraFrame>> seen, const CameraModel& model, Millimetres height,
                             std::span<const PanelCandidate> candidates, const BedPoseLimits& limits = {});

// What to tell of tags that have moved, or that disagree so that nobody can tell which has; "" when all lie as they
// were scanned.
std::string moved_tags_text(const BedPose& pose);

// The picture with what was found drawn in: the panel's outline, its tags, its name and face. `outline` is in
// PanelFrame and may be empty. The picture given is not changed.
cv::Mat draw_pose(const cv::Mat& picture, const CameraModel& model, Millimetres height, const BedPose& pose,
                  const PanelFiducials& fiducials, std::span<const Point<PanelFrame>> outline);

}  // namespace veneer::calib
