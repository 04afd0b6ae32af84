// What is asked of a scan, and what came of it. Values.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/face.h"
#include "base/ids.h"
#include "base/units.h"
#include "daemon/orders/scan_work.h"
#include "daemon/stock/found_differences.h"
#include "daemon/stock/suspect_sightings.h"
#include "db/proposals.h"

namespace veneer::daemon {

struct ScanRequest {
  Face face = Face::kShow;
  std::optional<PanelId> panel;    // needed for the first look at a panel's back
  std::optional<PanelId> part_of;  // a sawn panel, where the tags do not say so
  bool retag = false;              // strange tags were newly glued to the panel, and become its own
  bool more = false;               // further tiles follow
  // This scan is one tile of the series that was refused, counted from 1, once more: face, panel, part_of and retag are
  // that series' own where they are not said.
  std::optional<int> again;
  bool anew = false;                  // gives up the tiles of a series that was begun or refused
  bool accept = false;                // takes it into stock when each of its warnings is overruled
  std::vector<std::string> overrule;  // names of warnings
  std::string who = "veneerd";
};

struct ScanOutcome {
  std::size_t tiles = 0;         // collected so far
  std::optional<PanelId> panel;  // none while further tiles follow, and of a new sheet that waits to be accepted
  std::optional<db::ProposalId> proposal;  // that waits to be accepted or refused: nothing has changed yet
  bool is_new = false;
  std::optional<PanelId> part_of;  // of a new panel: the one that it was sawn from
  std::size_t carried = 0;         // pieces and scrap of that one that lay in its wood
  Face face = Face::kShow;
  std::optional<Millimetres> rms, max;  // of the registration
  std::optional<Millimetres> left_out;  // the worst fiducial of a later scan, from where the others put it
  std::vector<int> new_tags;            // that became the panel's
  SquareMillimetres usable{0};          // of a show face
  std::size_t zones = 0;
  std::optional<std::vector<FoundDifference>> differences;  // of a show face that was known: against the ledger
  std::vector<SeenSuspect> suspects;                        // of a show face that was known
  Millimetres width{0}, height{0};                          // of a show face: the sheet
  SquareMillimetres lost{0}, gained{0};                     // of a show face that was known: PanelRead
  std::vector<ScanWarning> warnings;                        // of a show face
};

}  // namespace veneer::daemon
