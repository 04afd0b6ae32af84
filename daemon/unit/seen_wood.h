// Is the wood of a job still there, as far as anybody has seen?
#pragma once

#include <vector>

#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "db/job_store.h"

namespace veneer::daemon {

// kRefused: a panel that reserved pieces among these are to be cut from was not scanned since a backup took the place
// of the database, or a scan found wood gone where one of them lies and nobody has decided. The sentence names the
// panel or the piece, and what to do. On the database's thread.
Status check_wood_is_there(Repositories& repositories, const std::vector<db::PieceRecord>& pieces);

}  // namespace veneer::daemon
