#include "daemon/unit/bed_view.h"

#include <utility>

namespace veneer::daemon {

void look_for_cut(BedView& bed, std::function<void(Result<ProvenPose>)> reply) {
  bed.look([&bed, reply = std::move(reply)](Result<ProvenPose> look) mutable {
    if (look.ok() || look.error().code != ErrorCode::kNotFound) return reply(std::move(look));
    bed.was_cut();  // the other one is another picture
    bed.look(std::move(reply));
  });
}

}  // namespace veneer::daemon
