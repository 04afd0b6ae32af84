// Holds what the eyes make of a composed panel against what truly lies there: the scan is registered, stitched and
// masked as a first scan is, and the mask compared place by place.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/veneer_mask.h"
#include "tests/support/workshop_panel.h"

namespace veneer::workshop {

struct StripVerdict {
  std::string wood;
  double precision = 1;  // of what the mask takes on the strip or nearest to it, the share that is wood
  double recall = 0;     // of the wood farther than the mask's margins from everything else, the share taken
  bool asked = false;    // the mask withholds something that lies on it, and says so
};

struct FaultVerdict {
  Fault fault;
  double taken = 0;  // share of the fault that lies within the mask
};

struct PanelVerdict {
  std::string board;
  std::string refused;       // the sentence, when the scan did not enter
  double outline_error = 0;  // of the sheet's corners at worst, mm
  double seconds = 0;        // of the mask alone
  std::vector<StripVerdict> strips;
  std::vector<FaultVerdict> faults;
  int false_warnings = 0;             // places that the mask asks about and that are no strip
  double hair = 0, hair_in_mask = 0;  // map pixels of hairs on the glass over wood, and those of them that are taken
  std::size_t hairs_told = 0;
  // For people to look at. `wrong` is 255 where what is taken is no wood, `missed` where wood should have been taken.
  cv::Mat map, usable, wrong, missed;
};

PanelVerdict judge(const Panel& panel);

// Precision at least 0.995 and recall at least 0.97.
bool holds(const StripVerdict& strip);
// Some of it is not taken, nothing wrong is, and the operator is told.
bool is_asked_about(const StripVerdict& strip);

// A picture of a whole panel without tags, and what of it is usable (CV_8UC1): the shares of what is taken that is, and
// of what is that is taken. Both 0 when the mask is refused.
struct PictureVerdict {
  double precision = 0, recall = 0;
  std::string refused;
  std::vector<std::string> asked;  // why
};
PictureVerdict judge_picture(const cv::Mat& picture, ScanResolution resolution, const cv::Mat& usable);

// The map with the mask drawn over it: what is taken keeps its colour, what is not turns blue, or yellow where it
// should have been taken. What should not have been is red.
cv::Mat overlay(const PanelVerdict& verdict);

}  // namespace veneer::workshop
