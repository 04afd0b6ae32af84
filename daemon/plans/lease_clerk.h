// Ends leases whose time has come: their wood is free again (db/leases.h). One that ends while the daemon is off is
// ended by recovery (daemon/recovery.h).
//
// Bound to the reactor.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/log.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

struct EndedLeases {
  std::vector<std::string> sentences;
  std::vector<PanelId> panels;  // whose wood is free
};
// All whose time has come by the computer's clock. On the database's thread.
Result<EndedLeases> expire_leases(Repositories& r);

class LeaseClerk {
 public:
  // `on_panel` is told each panel whose wood is somebody else's, or nobody's. The database outlives this.
  LeaseClerk(DatabaseThread& database, std::function<void(const PanelId& panel)> on_panel, Logger log)
      : database_(database), on_panel_(std::move(on_panel)), log_(std::move(log)) {}

  // A lease was made or ended, and wood of these panels is somebody else's, or nobody's.
  void changed(const std::vector<PanelId>& touched);
  // To be called again and again; asks the database only once it is time.
  void end_due();

 private:
  DatabaseThread& database_;
  std::function<void(const PanelId& panel)> on_panel_;
  Logger log_;
  std::string next_end_;  // of the lease that ends next; "" when none is known
};

}  // namespace veneer::daemon
