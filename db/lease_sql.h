// What other stores do with leases inside a transaction of their own. Private to db; these throw SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <optional>
#include <string>
#include <vector>

#include "base/polygon_ops.h"
#include "db/leases.h"

namespace veneer::db {

// The one that the plan has now.
std::optional<PlanLease> lease_of(SQLite::Database& connection, PlanId plan);
// False when the plan has none.
bool end_lease(SQLite::Database& connection, PlanId plan, LeaseEnd how, const std::string& at);
// As Leases::expire.
std::vector<PlanId> end_expired(SQLite::Database& connection, const std::string& at);
// Leases of wood that is gone, of which `area` is a part: what is left of it makes no picture.
void end_spoilt(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                const std::string& at);

}  // namespace veneer::db
