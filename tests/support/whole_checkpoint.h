// Whether the log beside a daemon's database can be emptied.
#pragma once

#include "daemon/store/database_thread.h"
#include "tests/db/whole_checkpoint.h"

namespace veneer::testing {

// Of what is written here. A question that is over within a moment may be in its way once, so it is tried again.
inline bool checkpoint_completes(daemon::DatabaseThread& database) {
  constexpr int kTries = 1000;
  const Status written = database.call([](daemon::Repositories& r) {
    return r.audit.append({0, "2026-05-01T07:30:00.000Z", "uid 1000", "test", ""});
  });
  for (int i = 0; written && i < kTries; ++i)
    if (database.call([](daemon::Repositories& r) { return db::checkpoint_is_whole(r.connection); })) return true;
  return false;
}

}  // namespace veneer::testing
