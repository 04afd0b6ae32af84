// Who did what a row of another table tells (the table done_by), for statements within a transaction.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <cstdint>
#include <string>

namespace veneer::db {

// What `number` is of: jobs, job_history, archivings, retirements, or a lease that ended.
enum class Done { kJobMade, kJobMoved, kJobArchived, kPanelRetired, kLeaseEnded };

// In the transaction that did it. Nothing is noted of what nobody ("") did.
void note_done_by(SQLite::Database& connection, Done what, std::int64_t number, const std::string& who);

}  // namespace veneer::db
