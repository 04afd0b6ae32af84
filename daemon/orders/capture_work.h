// What a worker process does with scanners (capture_order.h). Not confined as others are: it needs devices and the
// network (WorkOrder::devices).
#pragma once

#include <span>

#include "daemon/orders/kind_of_work.h"

namespace veneer::daemon {

std::span<const KindOfWork> scanner_work();

}  // namespace veneer::daemon
