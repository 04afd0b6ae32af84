// Leases: the wood of a plan that is kept, held for it until a time, so that no other plan gets it meanwhile. The wood
// is in the ledger like all that is booked (`leased`), one allocation for each placement of the plan, so that whatever
// asks what is free needs to know nothing of leases. A lease ends once and for good, by its time, by a person, when a
// job of its plan takes the wood over (JobStore::create), or when the wood turns out to be gone; its end releases the
// wood in the same statement. A plan has one lease at a time.
//
// Time is the caller's: a lease is over once `at` has reached its `until`, and everything that would book wood or
// retire a panel ends those first, in its own transaction. A clock that is set forward ends leases early (the plan
// stays, its wood is free to be leased again), one that is set back lets them last; what has ended stays so.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "db/database.h"
#include "db/plans.h"

namespace veneer::db {

enum class LeaseEnd {
  kExpired,
  kReleased,  // a person gave it back
  kTaken,     // a job was made of the plan
  kSpoilt,    // wood of it was found gone and written off
};
const char* to_string(LeaseEnd end);

class Leases {
 public:
  explicit Leases(Database& database) : database_(&database) {}

  // Leases the plan's wood until then, or renews the lease that it has. All of the wood, or nothing: kConflict names
  // the piece whose wood is somebody else's, or the panel that was scanned again since (as JobStore::create does), or
  // says that the plan takes no wood or is not whole. kInvalidArgument: `until` is not later than `at`.
  Result<PlanLease> take(PlanId plan, const std::string& who, const std::string& at, const std::string& until);
  // As `who` said, which is kept with its end unless it is empty. kConflict when the plan has no lease. kNotFound.
  Status release(PlanId plan, const std::string& at, const std::string& who = {});
  // Ends every lease whose time has come; the plans they were of. Noted in the audit log.
  Result<std::vector<PlanId>> expire(const std::string& at);
  // When the next one ends; "" when there is none.
  Result<std::string> next_end();

 private:
  Database* database_;
};

}  // namespace veneer::db
