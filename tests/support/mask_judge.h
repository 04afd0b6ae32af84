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
  cv::Mat map, usable;  // for people to look at
};

PanelVerdict judge(const Panel& panel);

// Precision at least 0.995 and recall at least 0.97.
bool holds(const StripVerdict& strip);

// The map with the mask drawn over it: what is taken keeps its colour, what is not turns blue.
cv::Mat overlay(const PanelVerdict& verdict);

}  // namespace veneer::workshop
