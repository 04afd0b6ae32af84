// What a worker process does with scans: what is seen on one, and what panel several make. Pure but for files.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/face.h"
#include "base/frames.h"
#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "base/units.h"
#include "calib/fiducials.h"
#include "calib/reconcile.h"
#include "calib/registration.h"
#include "calib/scanner_model.h"
#include "calib/veneer_mask.h"
#include "daemon/orders/scan_doubts.h"
#include "daemon/workers/work_runner.h"
#include "db/materials.h"

namespace veneer::daemon {

// One raw scan, as the scanner left it.
struct ViewScan {
  static constexpr const char* kKind = "view_scan";
  std::string file;
  std::string name;  // for sentences: "twin:capture-3"
  ScanResolution nominal;
};
// What an answer leaves in the work's folder; a picture as the cell stores it.
inline constexpr const char *kMadeScan = "scan.png", *kMadeMap = "map.png", *kMadeMask = "mask.png";
struct ScanView {
  calib::TileView tile;
  std::vector<ScanWarning> warnings;  // of this scan alone
};
// The scan becomes kMadeScan, its pixels as they lie on the glass.
Result<ScanView> view_scan(const ViewScan& order, const std::filesystem::path& folder, const TaskProgress& progress);

// All tiles of one face, registered; of a show face also the veneer map and its mask (kMadeMap, kMadeMask), its zones,
// and how it differs from what the ledger says.
struct RegisterScans {
  static constexpr const char* kKind = "register_scans";
  std::vector<calib::TileView> views;
  std::vector<std::string> files;  // those of kMadeScan, in the same order
  calib::ScannerModelData scanner;
  Face face = Face::kShow;
  std::optional<calib::PanelFiducials> known;  // none: a panel's first scan
  std::set<int> foreign_tags;
  // Of a show face that was known: the panel's size, its maps from the oldest one on, masks of which any calls wood
  // what the ledger takes for wood, its map and mask until now, and what the ledger holds for cut. The scan is compared
  // with the oldest map that can be read and is of the panel's size. Where a mask is lost all of the sheet may be wood;
  // where what counts until now is, somebody has to look (scan_doubts.h).
  Millimetres width{0}, height{0};
  std::vector<std::string> maps;
  std::vector<std::string> wood_masks;
  std::vector<Region<PanelFrame>> told_gone;  // wood that an earlier scan did not see, and that is not booked
  std::string earlier_map, earlier_mask;
  std::vector<Region<PanelFrame>> gone;
  std::vector<Region<PanelFrame>> held;      // what else the ledger holds: wood that is not free, and not gone
  std::vector<Region<PanelFrame>> suspects;  // outlines of pieces of which nobody knows whether they were cut out
  bool retag = false;  // tags that the panel never had become its own (calib::RegistrationOptions)
  Millimetres edge_margin{0.5}, round_margin{0.7};  // that the mask keeps (calib::MaskOptions)
};
struct PanelRead {
  std::optional<Millimetres> rms, max;
  calib::PanelFiducials fiducials;
  Box<PanelFrame> sheet;
  std::vector<std::string> lattices;  // of each tile: lattice_text()
  std::vector<db::ZoneRecord> zones;
  std::vector<calib::AskedStrip> asked;             // the first of them is that of the warning strip-1
  Millimetres edge_margin{0.5}, round_margin{0.7};  // that its mask keeps, as in the order
  SquareMillimetres usable{0};
  std::optional<std::vector<calib::Difference>> differences;  // of a panel that was known
  std::vector<double> suspects_gone;  // of the inside of each suspect, in the same order: the share that is missing
  // Of a panel that was known: free wood of its mask until now that the new one would take, but for what lies beside
  // cuts, and wood that it would give back; patches wider than a millimetre.
  SquareMillimetres lost{0}, gained{0};
  std::vector<ScanWarning> warnings;
  // Of a face that was known: the tags that became its own, and how far the worst of its fiducials lies from where the
  // others put it.
  std::vector<int> new_tags;
  std::optional<Millimetres> left_out;
};
Result<PanelRead> register_scans(const RegisterScans& order, const std::filesystem::path& folder,
                                 const TaskProgress& progress);

// A map given as samples: scan pixels on a square lattice -> panel millimetres, bilinear between; and, of a later scan,
// how far each fiducial lies from where the others put it (packed_lattice.h). What GET /panels/{id}/registration tells
// of each scan.
std::string lattice_text(const calib::ScanMap& panel_from_scan, int width_px, int height_px,
                         const std::vector<calib::FiducialOffset>& offsets = {});

}  // namespace veneer::daemon
