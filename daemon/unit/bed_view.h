// The camera over the bed, as the unit needs it: what lies there. Looks are taken on the camera's worker; replies come
// on the reactor.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/unit/proven_pose.h"

namespace veneer::daemon {

// What speaks for wood of the stock on the bed.
struct StockSight {
  std::vector<PanelId> panels;      // that show a tag of theirs, or holes that lie as theirs do
  std::vector<std::string> doubts;  // why another may lie there all the same, each as part of a sentence; mostly empty
};

class BedView {
 public:
  virtual ~BedView() = default;
  // The panel on the bed and where it lies, from a fresh picture. kNotFound when the bed is seen and no panel of the
  // stock on it, kRefused when what is seen proves no pose, kUnavailable when nothing is seen at all (the light is off,
  // the lens covered, the camera gone).
  virtual void look(std::function<void(Result<ProvenPose>)> reply) = 0;
  // Hands may have been at the bed until now, or the beam will be: a picture that was taken before proves nothing from
  // here on. Matters for cameras that cannot take one when they are asked (CameraDriver::taken_at).
  virtual void hands_were_in() = 0;
  // Something was cut until now: a picture from before says nothing of what became of it, as if hands had been in.
  virtual void was_cut() = 0;
  // Does wood of the stock lie there? From a fresh picture, and from what was seen there last; needs no calibration
  // for tags, the camera's for holes. Without a picture when no panel has a tag or hole that could be seen.
  virtual void stock_in_sight(std::function<void(Result<StockSight>)> reply) = 0;
};

// A look for what was cut. That its panel is not there is believed of two pictures, since one may be broken. `bed`
// outlives the answer.
void look_for_cut(BedView& bed, std::function<void(Result<ProvenPose>)> reply);

}  // namespace veneer::daemon
