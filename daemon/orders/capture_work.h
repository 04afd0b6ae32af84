// What a worker process does with scanners and cameras (capture_order.h). Not confined as others are: it needs devices,
// and for scanners the network (WorkOrder).
#pragma once

#include <span>

#include "daemon/orders/kind_of_work.h"

namespace veneer::daemon {

std::span<const KindOfWork> capture_work();

}  // namespace veneer::daemon
