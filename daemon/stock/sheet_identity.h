// Whose sheet lies on the glass: which panel and which face, or which panel it was sawn from, by its tags and by what
// whoever scans it says; against the panels in stock and those that were sawn apart.
//
// Threading: blocks on the database.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "base/result.h"
#include "calib/registration.h"
#include "daemon/stock/scan_proposals.h"
#include "daemon/stock/scan_series.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

// What the database knows of the sheet on the glass.
struct KnownSheet {
  std::optional<db::PanelRecord> panel;
  calib::PanelFiducials fiducials;
  std::set<int> foreign_tags;
  Face face = Face::kShow;
  bool later_map = false;  // its first map is not there: the scan is compared with a later one
  // Of a sheet that is new: the sawn panel that it is a part of.
  std::optional<PanelId> parent;
  calib::PanelFiducials parent_fiducials;
  std::vector<SuspectWood> suspects;  // of a panel: its wood that may have been cut
  std::map<PanelId, calib::PanelFiducials> stock;
};

// kNotFound, kConflict, kInvalidArgument or kRefused where tags and request do not go together, each with what to do.
Result<KnownSheet> identify(DatabaseThread& database, const ScanRequest& request, std::span<const ScanTile> tiles);

// kRefused when a picture of these was scanned before.
Status require_news(DatabaseThread& database, const KnownSheet& sheet, std::span<const ScanTile> tiles);

}  // namespace veneer::daemon
