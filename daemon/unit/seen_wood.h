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

// The same of pieces of one job whose strokes are drawn already, and kRefused when the wood of one is not reserved any
// more, or it is to be cut from other wood by now: they would burn what is not its own. On the database's thread.
Status check_drawn_pieces(Repositories& repositories, const std::vector<db::PieceRecord>& drawn);

}  // namespace veneer::daemon
