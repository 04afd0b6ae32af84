// The camera over the bed, as the unit needs it: what lies there. Looks are taken on the camera's worker; replies come
// on the reactor.
#pragma once

#include <functional>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/unit/proven_pose.h"

namespace veneer::daemon {

class BedView {
 public:
  virtual ~BedView() = default;
  // The panel on the bed and where it lies, from a fresh picture. kNotFound when none is seen, kRefused when what is
  // seen proves no pose.
  virtual void look(std::function<void(Result<ProvenPose>)> reply) = 0;
  // Hands may have been at the bed until now, or the beam will be: a picture that was taken before proves nothing from
  // here on. Matters for cameras that cannot take one when they are asked (CameraDriver::taken_at).
  virtual void hands_were_in() = 0;
  // Which panels of the stock show a tag, from a fresh picture; needs no calibration. None, without a picture, when
  // there is no stock.
  virtual void stock_in_sight(std::function<void(Result<std::vector<PanelId>>)> reply) = 0;
};

}  // namespace veneer::daemon
