// Which pieces of a job are made again from other wood. Pure.
#pragma once

#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "db/job_store.h"

namespace veneer::daemon {

// The marks of those `named`, or of all that are missing where none is. `lost`: those that are cut are lost.
// kInvalidArgument: none is missing. kNotFound: the job has no such piece. kConflict: a piece is suspect, is still to
// be cut, or is cut and not said to be lost.
Result<std::vector<std::string>> marks_to_redo(const std::vector<db::PieceRecord>& pieces, JobId job,
                                               const std::vector<std::string>& named, bool lost);

// kConflict when one of these is cut: whoever called a piece missing may have found it while other wood was looked for.
Status none_is_good(const std::vector<db::PieceRecord>& pieces, JobId job, const std::vector<std::string>& marks);

}  // namespace veneer::daemon
