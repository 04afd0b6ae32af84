// What a scan of a show face showed, and what it was compared with; and how a proposal keeps it, as JSON, until
// somebody decides. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "calib/registration.h"
#include "daemon/orders/scan_work.h"
#include "db/proposals.h"

namespace veneer::daemon {

// A raw scan in the data folder.
struct TakenTile {
  std::string file, sha256, device, taken_at;
  double dpi = 0;
};
// Wood that was suspect when the scan was looked at.
struct SuspectWood {
  std::int64_t allocation = 0, piece = 0;
};

// What a scan of a show face showed, and what it was compared with.
struct SeenSheet {
  PanelRead read;
  std::vector<TakenTile> tiles;
  std::string map_file, map_sha256, mask_file;  // in the data folder
  std::optional<PanelId> panel;                 // a known one
  int after = 0;                                // and the version of its mask
  // Its first map is lost: it was compared with a later one, which may have been made after a suspect's wood had gone.
  // Wood that shows no change since is then a sighting that is unclear, never one that is still there.
  bool later_map = false;
  std::optional<PanelId> parent;  // of a new one: the sawn panel that it is a part of
  calib::PanelFiducials parent_fiducials;
  std::vector<SuspectWood> suspects;
};

std::string to_text(const SeenSheet& seen);
// Also of a scan that waited while the program became this one; nothing where it is no such text.
std::optional<SeenSheet> seen_from_text(const std::string& text);

// Its warnings, which are told with it.
std::string to_text(const std::vector<ScanWarning>& warnings);
std::vector<ScanWarning> warnings_of(const db::ProposalRecord& proposal);

}  // namespace veneer::daemon
