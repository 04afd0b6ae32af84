// How much of a panel's wood is usable, free, reserved and cut. Asked for again and again, so what has not changed is
// kept: the usable area with its mask (PanelRecord); what is booked and free in the stock's memory; here the areas of
// some allocations, and what each allocation takes of a mask's wood for the panels last looked at.
//
// Thread-safe; reads through the connection it is given.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/result.h"
#include "base/units.h"
#include "daemon/stock/area_book.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/stock_memory.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

class PanelFigures {
 public:
  struct Figures {
    double usable = 0;             // mm2, of the newest mask, whether allocated or not
    double free = 0;               // mm2, of that what nothing live is booked on: what a plan may use
    double reserved = 0, cut = 0;  // mm2, booked, kerf included
    int pieces = 0;
    int open_differences = 0;  // between its wood and the ledger, that nobody has decided on
    bool back_known = false;
    std::optional<Millimetres> rms;
  };

  // `library` and `memory` outlive this.
  PanelFigures(const PanelLibrary& library, StockMemory& memory) : library_(library), memory_(memory) {}

  // What is asked once for all panels that are told of together.
  struct Asked {
    std::int64_t newest = 0;  // step of the ledger's history
    std::map<PanelId, db::PanelSummary> summaries;
  };
  Result<Asked> ask(Repositories& r);

  Result<Figures> of(Repositories& r, const db::PanelRecord& panel);
  Result<Figures> of(Repositories& r, const db::PanelRecord& panel, const Asked& asked);
  Result<double> free(Repositories& r, const db::PanelRecord& panel);  // as Figures tell it
  Result<double> free(Repositories& r, const db::PanelRecord& panel, std::int64_t newest);
  // Looks at its mask where that has to be, so that of() need not.
  Status count(Repositories& r, const db::PanelRecord& panel, std::int64_t newest);
  // What each square millimetre of it is; nothing when its mask cannot be read.
  Result<std::optional<AreaBook>> book(Repositories& r, const db::PanelRecord& panel);
  // Whether all of this is told without a look at its mask, which takes long.
  Result<bool> knows(Repositories& r, const db::PanelRecord& panel);

 private:
  // What is booked, and what that leaves of a mask.
  struct Wood {
    double free = 0, reserved = 0, cut = 0;  // mm2
    int pieces = 0;
  };
  struct Booked {
    std::string mask_file;
    MaskedWood panel;
    std::unordered_map<std::int64_t, BookedWood> wood;  // by allocation
  };
  Result<Wood> wood_of(Repositories& r, const db::PanelRecord& panel, std::int64_t newest);
  Result<double> area_of(Repositories& r, db::AllocationId allocation);
  struct Free {
    double area = 0;   // mm2
    std::string wood;  // StockMemory::State::wood of what it was counted of
  };
  // Of the wood so named, or of what is free by now; nothing when its mask cannot be read, this time.
  Result<std::optional<Free>> free_of(Repositories& r, const db::PanelRecord& panel, const std::string& wood);
  Booked booked_on(const db::PanelRecord& panel);
  void keep_booked(const PanelId& panel, const Booked& booked);

  const PanelLibrary& library_;
  StockMemory& memory_;
  std::mutex mutex_;
  std::unordered_map<std::int64_t, double> areas_;  // of allocations, mm2; guarded by mutex_
  std::list<std::pair<PanelId, Booked>> booked_;    // the last one asked for first; guarded by mutex_
};

}  // namespace veneer::daemon
