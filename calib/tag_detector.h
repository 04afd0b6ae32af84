// Finds AprilTags (family 36h11) in a picture.
//
// Corners are in pixels, y down, pixel centres at +0.5 (libapriltag's convention, the project's own). Seen with the tag
// upright they are: 0 lower left, 1 lower right, 2 upper right, 3 upper left; so they run counter-clockwise on the
// screen, and 0 -> 1 is the tag's own +x. They lie on the outer border of the black square. A mirrored tag is not
// found.
//
// Accuracy: corners within 0.05 px of the truth on a sharp scan; at 300 dpi that is 4 um.
// Threads: every call owns its detector, so calls may run at the same time; each keeps to the thread that makes it.
// The only user of libapriltag's detector is tag_detector.cc.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/geometry.h"

namespace veneer::calib {

template <class Frame>
struct Tag {
  int id = -1;
  std::array<Point<Frame>, 4> corners{};
  Point<Frame> centre{};       // where the diagonals cross
  double decision_margin = 0;  // contrast of the bits, in grey levels; above 30 is a safe reading
};

struct TagOptions {
  // Quads are searched on the picture divided by this, corners are then refined on the full picture. 2 finds tags from
  // about 30 px upwards; 4 wants 80 px.
  double decimate = 2;
  int corrected_bits = 1;
  double min_decision_margin = 25;
};

// `picture` is 8 bit, grey or BGR; anything else, or an empty picture, gives no tags. Tags come sorted by id, and an id
// seen twice comes twice. Frame is ScanFrame or CameraFrame.
template <class Frame>
std::vector<Tag<Frame>> detect_tags(const cv::Mat& picture, const TagOptions& options = {});

extern template std::vector<Tag<ScanFrame>> detect_tags<ScanFrame>(const cv::Mat&, const TagOptions&);
extern template std::vector<Tag<CameraFrame>> detect_tags<CameraFrame>(const cv::Mat&, const TagOptions&);

}  // namespace veneer::calib
