// From what lies on the scanner's glass to a proposal: capture, register, stitch, mask; or, for a panel that is known
// already, its other face, or a comparison of its wood with the ledger. A new sheet that carries tags of a panel that
// was sawn apart is a part of that. A first scan, and one that would change much of a panel's wood, waits to be
// accepted (daemon/stock/scan_proposals.h).
//
// Pictures are looked at by worker processes (daemon/orders/scan_work.h). Tiles of one face are collected until one
// comes without `more`; of several that are refused one can be scanned again, until anything else is. Threading:
// add_tile() blocks; it and give_up_kept() are called on the scanner's worker only.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "calib/registration.h"
#include "daemon/config.h"
#include "daemon/orders/scan_work.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/scan_proposals.h"
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

class ScanService {
 public:
  // All references outlive this.
  ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library, WorkRunner& workers,
              ScanProposals& proposals, const Config& config);

  Result<ScanOutcome> add_tile(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);

  // A series that was refused and is kept, of hundreds of megabytes each tile. Thread-safe.
  struct Kept {
    std::size_t tiles = 0;
    std::string since;
    // For a day, and while there is room.
    bool is_over(const std::string& a_day_ago, bool has_room) const { return since < a_day_ago || !has_room; }
  };
  std::optional<Kept> kept() const;
  // A series that was begun with `more` and not ended: whoever comes by may go on with it, or give it up. Thread-safe.
  struct Open {
    std::optional<PanelId> panel;  // as its last tile was asked for
    Face face = Face::kShow;
    std::size_t tiles = 0;
    bool retag = false;  // as one of its tiles was scanned
  };
  std::optional<Open> open() const;
  void give_up_kept();

 private:
  struct Tile {
    WorkFolder folder;  // holds the picture, kMadeScan
    std::string device, make;
    calib::TileView view;
    std::vector<ScanWarning> warnings;
    std::string sha256;  // of the picture
    std::optional<PanelLibrary::Stored> stored;
    std::string taken_at = utc_timestamp();
  };
  // What the database knows of the sheet on the glass.
  struct Known {
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
  // Panels in stock and sawn ones, the one that was sawn last first.
  struct Stock {
    std::vector<db::PanelRecord> panels;
    std::vector<PanelId> sawn;
    std::map<PanelId, calib::PanelFiducials> fiducials;
  };

  Result<ScanRequest> as_refused(const ScanRequest& request) const;
  Result<Tile> scan_tile(const TaskProgress& progress, const std::stop_token& stop);
  Result<Tile> scan_new_tile(const TaskProgress& progress, const std::stop_token& stop);
  bool is_there(const Tile& tile) const;
  void note_kept();
  void note_open(const ScanRequest& request);
  void give_up();  // all tiles, of whatever series
  std::filesystem::path picture_of(const Tile& tile) const;
  Result<ScanOutcome> end_series(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);
  Result<ScanOutcome> finish(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);
  Result<Stock> read_stock();
  Result<Known> identify(const ScanRequest& request);
  Status require_news(const Known& known);
  Result<std::optional<PanelId>> parent_of(const ScanRequest& request, const Stock& stock) const;
  std::map<std::pair<PanelId, Face>, int> count_tags(const Stock& stock, const std::vector<PanelId>& panels) const;
  Result<RegisterScans> ask_of(Known& known, const calib::ScannerModelData& scanner, WorkOrder& work);
  Result<std::vector<TakenTile>> store_tiles(Face face);
  Result<ScanOutcome> add_back(const Known& known, const PanelRead& read);
  Result<ScanOutcome> propose(const ScanRequest& request, const Known& known, PanelRead read, const WorkFolder& folder);
  WorkOrder order(const char* kind, const char* what, const WorkFolder& folder) const;

  ScannerDriver& scanner_;
  DatabaseThread& database_;
  const PanelLibrary& library_;
  WorkRunner& workers_;
  ScanProposals& proposals_;
  const Config& config_;
  std::vector<Tile> tiles_;
  Face face_of_tiles_ = Face::kShow;
  std::optional<ScanRequest> refused_;  // how the series was asked for that `tiles_` are kept of
  mutable std::mutex kept_mutex_;
  std::optional<Kept> kept_;  // guarded by kept_mutex_
  std::optional<Open> open_;  // guarded by kept_mutex_
};

}  // namespace veneer::daemon
