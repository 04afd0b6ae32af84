// From what lies on the scanner's glass to a proposal: capture, register, stitch, mask; or, for a panel that is known
// already, its other face, or a comparison of its wood with the ledger. A new sheet that carries tags of a panel that
// was sawn apart is a part of that. A first scan, and one that would change much of a panel's wood, waits to be
// accepted (daemon/stock/scan_proposals.h).
//
// Pictures are looked at by worker processes (daemon/orders/scan_work.h). Tiles of one face are collected until one
// comes without `more` (scan_series.h); then it is asked whose sheet they show (sheet_identity.h). Threading:
// add_tile() blocks; it and give_up_kept() are called on the scanner's worker only.
#pragma once

#include <optional>
#include <stop_token>

#include "base/result.h"
#include "daemon/config.h"
#include "daemon/orders/scan_work.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/scan_proposals.h"
#include "daemon/stock/scan_series.h"
#include "daemon/stock/sheet_identity.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"
#include "daemon/workers/work_folder.h"
#include "daemon/workers/work_runner.h"
#include "drivers/scanner_driver.h"

namespace veneer::daemon {

class ScanService {
 public:
  // All references outlive this.
  ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library, WorkRunner& workers,
              ScanProposals& proposals, const Config& config);

  Result<ScanOutcome> add_tile(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);

  // Thread-safe.
  std::optional<ScanSeries::Kept> kept() const { return series_.kept(); }
  std::optional<ScanSeries::Open> open() const { return series_.open(); }
  void give_up_kept() { series_.give_up_kept(); }

 private:
  Result<ScanTile> scan_tile(const TaskProgress& progress, const std::stop_token& stop);
  Result<ScanTile> scan_new_tile(const TaskProgress& progress, const std::stop_token& stop);
  Result<ScanOutcome> finish(const ScanRequest& request, const TaskProgress& progress, const std::stop_token& stop);
  Result<RegisterScans> ask_of(KnownSheet& known, const calib::ScannerModelData& scanner, WorkOrder& work);
  Result<ScanOutcome> add_back(const KnownSheet& known, const PanelRead& read);
  Result<ScanOutcome> propose(const ScanRequest& request, const KnownSheet& known, PanelRead read,
                              const WorkFolder& folder);
  WorkOrder order(const char* kind, const char* what, const WorkFolder& folder) const;

  ScannerDriver& scanner_;
  DatabaseThread& database_;
  const PanelLibrary& library_;
  WorkRunner& workers_;
  ScanProposals& proposals_;
  const Config& config_;
  ScanSeries series_;
};

}  // namespace veneer::daemon
