// What must hold before a plan's wood is booked, for a job or under a lease, beyond what the database sees to itself.
#pragma once

#include <string>

#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "db/plans.h"

namespace veneer::daemon {

// Leases whose time has come end first. kConflict: keeps_web(). kRefused: a panel's back was never scanned. On the
// database's thread, in the same call as the booking.
Status may_have_wood(Repositories& repositories, db::PlanId plan, const std::string& now);

}  // namespace veneer::daemon
