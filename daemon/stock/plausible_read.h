// What a worker process read of a panel: could it be what was asked for? It is kept, and read again whenever somebody
// asks. Pure.
#pragma once

#include <cstddef>

#include "daemon/orders/scan_work.h"

namespace veneer::daemon {

// Of so many tiles, and of so many pieces whose wood is suspect.
bool is_plausible(const PanelRead& read, std::size_t tiles, std::size_t suspects);

}  // namespace veneer::daemon
