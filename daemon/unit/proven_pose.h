// What the camera proved about the sheet on the bed.
#pragma once

#include <string>

#include "base/frames.h"
#include "base/ids.h"
#include "base/result.h"

namespace veneer::daemon {

struct ProvenPose {
  PanelId panel;
  bool back_up = false;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  Millimetres rms{0};
  std::string moved_tags = {};  // what to tell of tags that have moved and do not count; "" when there are none
};

// Back up, and the tags' layout says so as well.
bool lies_back_up(const ProvenPose& pose);

// Since the panel was shown to the operator: more is a hand in between, less is the camera's noise.
inline constexpr Millimetres kMovedSinceShown{0.3};
// Since the strokes were drawn for it: what is cut next must fit what is cut.
inline constexpr Millimetres kMovedSinceBegun{0.15};

// Does a look say where the panel is, though it be elsewhere? A camera that does not answer, an old picture or one that
// shows nothing does not; an empty bed does.
bool tells_where(const Result<ProvenPose>& look);

// How far the panel lies from where the other pose has it, at the worst of places far apart.
Millimetres moved_between(const ProvenPose& a, const ProvenPose& b);

// kRefused, saying what is wrong, unless the camera sees the panel of `known` back up and within `tolerance` of where
// it was. `since` ends the sentence: "since it was cut".
Status require_unmoved(const Result<ProvenPose>& look, const ProvenPose& known, Millimetres tolerance,
                       const char* since);

}  // namespace veneer::daemon
