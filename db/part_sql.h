// What a panel takes over from another one: a part from the parent that it was sawn from, or a panel from its other
// record. Private to db; throws SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <cstdint>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/polygon_ops.h"
#include "db/panels.h"

namespace veneer::db {

// Wood of a panel that is booked, as the panel that takes it over books it.
struct Gone {
  std::int64_t allocation = 0;
  std::string state, reason;  // whose it was
  Region<PanelFrame> area;
  Ring<PanelFrame> outline;  // of the piece; empty where there was none
  Region<PanelFrame> lead_in;
};
std::vector<Gone> gone_from(SQLite::Database& connection, const PanelId& panel);
// `area` of `wood`, and its outline and lead-in moved by `map`, as wood of `panel`.
void book_carried(SQLite::Database& connection, const PanelId& panel, const Gone& wood, const Region<PanelFrame>& area,
                  const Isometry2<PanelFrame, PanelFrame>& map, const std::string& at);

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
