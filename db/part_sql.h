// What a part that was sawn off takes over from its parent. Private to db; throws SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>
#include <vector>

#include "base/frames.h"
#include "base/polygon_ops.h"
#include "db/panels.h"

namespace veneer::db {

// Areas that share no more than borders, moved and clipped to `within`; the n-th of the n-th, empty where nothing is
// left. Nor do those share more: where rounding to whole micrometres would let two overlap, the later one ends 3 um
// before the earlier.
std::vector<Region<PanelFrame>> moved_apart(const std::vector<Region<PanelFrame>>& areas,
                                            const Isometry2<PanelFrame, PanelFrame>& map,
                                            const Region<PanelFrame>& within);

// Enters where the part lay, and books in it what was cut from its wood or written off while it was its parent's; what
// people know of the parent's thickness and surface is known of the part.
void carry_over(SQLite::Database& connection, const PanelRecord& panel, const PartRecord& part, const std::string& at);

}  // namespace veneer::db
