// Books what is left of panels after runs and scans (db/remnant_book.h): counted, with a picture, on a thread of its
// own that goes behind all others, for as many as are due. What was missed, by a kill or a full disk, is due at the
// next look. Then what lists tell and searches ask for is counted of every panel whose wood has changed, also by a plan
// that reserved some, so that they need not look at masks; of a thousand panels that were imported it takes minutes.
//
// Thread-safe. A panel that is being counted when this ends is counted to its end.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "base/log.h"
#include "daemon/stock/panel_figures.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/remnants.h"
#include "daemon/stock/stock_memory.h"
#include "daemon/store/database_thread.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

class RemnantClerk {
 public:
  // All of them outlive this.
  RemnantClerk(DatabaseThread& database, const PanelLibrary& library, Remnants& remnants, PanelFigures& figures,
               StockMemory& memory, Logger log);
  ~RemnantClerk() { stopping_ = true; }

  // Looks soon whether something is due; cheap where a look waits already.
  void look();
  // The same at once, on this thread; takes long where much is due.
  void book_due();

 private:
  struct Left {
    db::PanelRecord panel;
    std::vector<db::AllocationRecord> live;
    Remnant remnant;
    db::RemnantRecord record;  // without a picture
  };
  Status count(Repositories& reading, const PanelId& panel);
  // All of it of one moment: what is free, and what fits in there. Counted before, or where wood was booked since.
  Result<Left> left(Repositories& reading, const db::RemnantBook::Due& due);
  std::string picture_of(const Left& left) const;  // its file, or ""
  void book(DatabaseReader& reader, const db::RemnantBook::Due& due);
  void count_for_lists_and_searches(Repositories& reading);

  DatabaseThread& database_;
  const PanelLibrary& library_;
  Remnants& remnants_;
  PanelFigures& figures_;
  StockMemory& memory_;
  Logger log_;
  std::atomic<bool> stopping_ = false;
  Worker worker_{"remnants", 15};  // last, so that it ends first
};

}  // namespace veneer::daemon
