// From what lies on the scanner's glass to a panel in stock: capture, register, stitch, mask; or, for a panel that is
// known already, its other face, or a comparison of its wood with the ledger. A new sheet that carries tags of a panel
// that was sawn apart is a part of that: what was gone from its wood before is booked in it.
//
// Pictures are looked at by worker processes (daemon/orders/scan_work.h). Tiles of one face are collected until one
// comes without `more`. Threading: add_tile() blocks and is called on the scanner's worker only.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "calib/part_relation.h"
#include "calib/reconcile.h"
#include "calib/registration.h"
#include "daemon/config.h"
#include "daemon/orders/scan_work.h"
#include "daemon/services/panel_library.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"
#include "daemon/workers/work_folder.h"
#include "daemon/workers/work_runner.h"
#include "drivers/scanner_driver.h"

namespace veneer::daemon {

struct ScanRequest {
  Face face = Face::kShow;
  std::optional<PanelId> panel;    // needed for the first look at a panel's back
  std::optional<PanelId> part_of;  // a sawn panel, where the tags do not say so
  bool more = false;               // further tiles follow
};

// What wood and ledger disagree about, and the pieces whose wood it is: cut ones that still hang there, reserved ones
// whose wood is gone.
struct FoundDifference {
  struct Piece {
    JobId job;
    std::string mark;
    db::AllocationState state = db::AllocationState::kReserved;
  };
  calib::Difference seen;
  std::vector<Piece> pieces;
};

// What a scan saw of a suspect piece's wood: a proposal.
struct SeenSuspect {
  JobId job;
  std::string mark;
  db::Sighting sighting;
};

struct ScanOutcome {
  std::size_t tiles = 0;         // collected so far
  std::optional<PanelId> panel;  // none while further tiles follow
  bool is_new = false;
  std::optional<PanelId> part_of;  // of a new panel: the one that it was sawn from
  std::size_t carried = 0;         // pieces and scrap of that one that lay in its wood
  Face face = Face::kShow;
  std::optional<Millimetres> rms, max;  // of the registration
  SquareMillimetres usable{0};          // of a show face
  std::size_t zones = 0;
  std::optional<std::vector<FoundDifference>> differences;  // of a show face that was known: against the ledger
  std::vector<SeenSuspect> suspects;                        // of a show face that was known
  std::vector<std::string> warnings;  // sentences for the operator: what of a show face is not used, and why
};

class ScanService {
 public:
  // All references outlive this.
  ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library, WorkRunner& workers,
              const Config& config, Logger log);

  Result<ScanOutcome> add_tile(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);

 private:
  struct Tile {
    WorkFolder folder;  // holds the picture, kMadeScan
    std::string device, make;
    calib::TileView view;
  };
  // What the database knows of the sheet on the glass.
  struct Known {
    std::optional<db::PanelRecord> panel;
    calib::PanelFiducials fiducials;
    std::set<int> foreign_tags;
    Face face = Face::kShow;
    bool later_map = false;  // its first map is lost: the scan is compared with a later one
    // Of a sheet that is new: the sawn panel that it is a part of.
    std::optional<PanelId> parent;
    calib::PanelFiducials parent_fiducials;
    std::vector<db::AllocationRecord> suspects;  // of a panel: its wood that may have been cut
  };
  // Panels in stock and sawn ones, the one that was sawn last first.
  struct Stock {
    std::vector<db::PanelRecord> panels;
    std::vector<PanelId> sawn;
    std::map<PanelId, calib::PanelFiducials> fiducials;
  };

  Result<ScanOutcome> finish(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);
  Result<Stock> read_stock();
  Result<Known> identify(const ScanRequest& request);
  Result<std::optional<PanelId>> parent_of(const ScanRequest& request, const Stock& stock) const;
  std::map<std::pair<PanelId, Face>, int> count_tags(const Stock& stock, const std::vector<PanelId>& panels) const;
  Result<std::vector<db::ScanRecord>> store_scans(const PanelId& panel, Face face, const PanelRead& read);
  Result<ScanOutcome> add_panel(const Known& known, const PanelRead& read, const WorkFolder& folder);
  Result<ScanOutcome> add_back(const Known& known, const PanelRead& read);
  Result<ScanOutcome> scan_again(const Known& known, const PanelRead& read, const WorkFolder& folder);
  WorkOrder order(const char* kind, const char* what, const WorkFolder& folder) const;

  ScannerDriver& scanner_;
  DatabaseThread& database_;
  const PanelLibrary& library_;
  WorkRunner& workers_;
  const Config& config_;
  Logger log_;
  std::vector<Tile> tiles_;
  Face face_of_tiles_ = Face::kShow;
};

}  // namespace veneer::daemon
