// What JobStore does with plans inside a transaction of its own. Private to db; these throw SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "db/plans.h"

namespace veneer::db {

// A transaction that was to store the plan was refused: removes its file, unless a row names it.
void forget_refused(Database& database, const NewPlan& plan, const Error& refused);
Result<PlanId> insert_plan(SQLite::Database& connection, const NewPlan& plan, const std::string& at);
// The plan places patches of the job's own plan, found by their marks, and has no patches itself. kNotFound: a mark
// that the job has no piece of. kInvalidArgument: a patch without wood, or with another outline than the job's.
Result<PlanId> insert_redo(SQLite::Database& connection, JobId job, const NewPlan& plan, const std::string& at);
// kConflict names the first of its panels that was scanned again since, kRefused one whose surface was treated since
// (StockFacts::check_surface).
Status check_masks(SQLite::Database& connection, PlanId plan);
// The same, and kConflict of a plan that makes pieces of a job again: it is no whole picture that could have wood of
// its own.
Status may_have_wood(SQLite::Database& connection, PlanId plan);
bool plan_exists(SQLite::Database& connection, PlanId plan);
Error no_such_plan(PlanId plan);

}  // namespace veneer::db
