#include "db/later_scans.h"

#include "db/sql.h"

namespace veneer::db {

Result<int> LaterScans::enter(const PanelId& panel, const LaterScan& scan, const std::optional<Acceptance>& of) {
  return in_transaction(*database_, [&](SQLite::Database&) -> Result<int> {
    Panels panels(*database_);
    auto version = panels.add_mask(panel, scan.mask, scan.after, of);
    if (!version.ok()) return version;
    if (Status zoned = Materials(*database_).add_zones(panel, scan.zones); !zoned.ok()) return zoned.error();
    if (scan.differences)
      if (Status told = Differences(*database_).found(panel, *scan.differences, scan.mask.made_at, scan.later_map);
          !told.ok())
        return told.error();
    auto sightings = scan.sightings;
    for (auto& [allocation, sighting] : sightings) sighting.mask_version = *version;
    if (Status noted = JobStore(*database_).note_sightings(sightings); !noted.ok()) return noted.error();
    if (Status added = panels.add_scans(panel, scan.scans, {}, scan.new_tags); !added.ok()) return added.error();
    return version;
  });
}

}  // namespace veneer::db
