// From what lies on the scanner's glass to a panel in stock: capture, register, stitch, mask; or, for a panel that is
// known already, its other face, or a comparison of its wood with the ledger.
//
// Tiles of one face are collected until one comes without `more`. Threading: add_tile() blocks and is called on the
// scanner's worker only.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "calib/reconcile.h"
#include "calib/registration.h"
#include "daemon/database_thread.h"
#include "daemon/services/calibration.h"
#include "daemon/services/panel_library.h"
#include "drivers/scanner_driver.h"

namespace veneer::daemon {

struct ScanRequest {
  Face face = Face::kShow;
  std::optional<PanelId> panel;  // needed for the first look at a panel's back
  bool more = false;             // further tiles follow
};

using TaskProgress = std::function<void(double fraction, const std::string& text)>;

struct ScanOutcome {
  std::size_t tiles = 0;         // collected so far
  std::optional<PanelId> panel;  // none while further tiles follow
  bool is_new = false;
  Face face = Face::kShow;
  std::optional<Millimetres> rms, max;  // of the registration
  SquareMillimetres usable{0};          // of a show face
  std::size_t zones = 0;
  std::optional<std::vector<calib::Difference>> differences;  // of a show face that was known: against the ledger
};

class ScanService {
 public:
  ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library, double dpi, Logger log);

  Result<ScanOutcome> add_tile(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);

 private:
  struct Tile {
    ScanImage image;
    calib::TileView view;
  };
  // What the database knows of the sheet on the glass.
  struct Known {
    std::optional<db::PanelRecord> panel;
    calib::PanelFiducials fiducials;
    std::set<int> foreign_tags;
    Face face = Face::kShow;
  };

  Result<ScanOutcome> finish(const ScanRequest& request, const TaskProgress& progress);
  Result<Known> identify(const ScanRequest& request);
  Result<std::vector<db::ScanRecord>> store_scans(const PanelId& panel, Face face,
                                                  const calib::Registration& registration);
  Result<ScanOutcome> add_panel(const calib::Registration& registration, const TaskProgress& progress);
  Result<ScanOutcome> add_back(const Known& known, const calib::Registration& registration);
  Result<ScanOutcome> scan_again(const Known& known, const calib::Registration& registration,
                                 const TaskProgress& progress);
  Result<Raster<PanelFrame>> stitch(const calib::Registration& registration, const Box<PanelFrame>& area) const;

  ScannerDriver& scanner_;
  DatabaseThread& database_;
  const PanelLibrary& library_;
  ScanResolution resolution_;
  Logger log_;
  std::vector<Tile> tiles_;
  Face face_of_tiles_ = Face::kShow;
};

// A map given as samples: scan pixels on a square lattice -> panel millimetres, bilinear between. What
// GET /panels/{id}/registration tells of each scan.
std::string lattice_text(const calib::ScanMap& panel_from_scan, int width_px, int height_px);

}  // namespace veneer::daemon
