// The label of a panel, to be printed and stuck on it or on its shelf: a QR code with its name, an AprilTag with its
// number, what it is of, how much of it is free, and what is left of it as a picture. 100 x 62 mm, which fits on a roll
// of 62 mm.
//
// The tag is read by a camera that is too far away for the QR code. It is of another family than the fiducials
// (calib/tag_pattern.h), and the picture shows none (Beside::kBlank), so that no label is taken for its panel by the
// scanner or the camera over the bed. The numbers of the panel's own tags are written out. Panels from 2115 on have no
// tag: the family has no such numbers. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/pages/printed_page.h"

namespace veneer::daemon {

struct PanelLabel {
  std::string panel;               // "P-0001": the heading, what the QR code says, the tag's number
  std::vector<std::string> lines;  // in UTF-8; what is too wide is set smaller
  cv::Mat picture;                 // CV_8UC3; of the free wood alone
};

// The file's bytes. kInternal: it could not be drawn.
Result<std::string> draw_label(const PanelLabel& label, planner::PageFormat format);

}  // namespace veneer::daemon
