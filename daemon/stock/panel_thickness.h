// How thick a panel is, face to face: its upper face lies so high over the bed. On the database's thread.
#pragma once

#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

// Veneer and substrate together where people have noted both (db::PanelFacts); else `configured`.
Result<Millimetres> thickness_of(Repositories& repositories, const PanelId& panel, Millimetres configured);

}  // namespace veneer::daemon
