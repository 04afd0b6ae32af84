// Two panels that turn out to be one sheet: scanned twice as new, or with its back taken for its show face.
#pragma once

#include <string>

#include "base/result.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

// Ties `merged` to `kept` by the tags and holes that both know, and enters it (Panels::merge): its wood that is gone,
// its tags and, of the other face, its scans become those of `kept`. Blocks on the database; reads come from `r`.
// kRefused: nothing shows that they are one sheet. kConflict, kNotFound as Panels::merge says.
Result<db::MergeRecord> merge_panels(Repositories& r, DatabaseThread& database, const PanelId& kept,
                                     const PanelId& merged, const std::string& who);

}  // namespace veneer::daemon
