// Notes in the table done_by who caused a row of another table, such as a new job. For use within a transaction.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <cstdint>
#include <string>

namespace veneer::db {

// Which table `number` is a key of, in this order: jobs, job_history, archivings, retirements, leases (one that ended).
enum class Done { kJobMade, kJobMoved, kJobArchived, kPanelRetired, kLeaseEnded };

// Call it in the transaction that writes that row. An empty `who` notes nothing.
void note_done_by(SQLite::Database& connection, Done what, std::int64_t number, const std::string& who);

}  // namespace veneer::db
