// What of a panel lies under a path of the head. On the database's thread: reads the certificates.
#pragma once

#include <string>

#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/proven_pose.h"

namespace veneer::daemon {

// All wood within `reach` of the path, and half a kerf more. `now` decides which certificates are in force; kRefused
// when one is missing.
Result<Region<PanelFrame>> wood_under(Repositories& repositories, const ProvenPose& pose,
                                      const Polyline<MachineFrame>& path, Millimetres reach, const std::string& now);

// Writes off the wood under a path that marks but does not cut, before it is burnt. kRefused, naming the piece, when it
// would cross wood that is kept for a piece; `own` are the pieces whose cuts the path surrounds.
Status write_off_under(Repositories& repositories, const ProvenPose& pose, const Polyline<MachineFrame>& path,
                       const std::vector<PieceId>& own, const std::string& reason, const std::string& at);

}  // namespace veneer::daemon
