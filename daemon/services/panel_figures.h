// How much of a panel's wood is usable, free, reserved and cut. Asked for again and again, so what has not changed is
// kept: the usable area with its mask (PanelRecord); here all that is booked on a panel, until the ledger's history
// says that wood of it moved, the area of an allocation, what a mask leaves free beside the live allocations, and what
// each allocation takes of a mask's wood.
//
// Thread-safe; reads through the connection it is given.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "base/result.h"
#include "base/units.h"
#include "daemon/services/area_book.h"
#include "daemon/services/panel_library.h"
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

  // `library` outlives this.
  explicit PanelFigures(const PanelLibrary& library) : library_(library) {}

  Result<Figures> of(Repositories& r, const db::PanelRecord& panel);
  // What each square millimetre of it is; nothing when its mask cannot be read.
  Result<std::optional<AreaBook>> book(Repositories& r, const db::PanelRecord& panel);

 private:
  // What is booked, and what that leaves of a mask.
  struct Wood {
    std::string mask_file;
    double free = 0, reserved = 0, cut = 0;  // mm2
    int pieces = 0;
    std::int64_t counted_at = 0;  // step of the ledger's history: what came after it is not in it
  };
  struct Free {
    std::string of;  // the mask and the live allocations that it was counted for
    double area = 0;
  };
  struct Booked {
    std::string mask_file;
    SquareMillimetres usable{0};
    std::unordered_map<std::int64_t, BookedWood> wood;  // by allocation
  };
  Result<std::int64_t> note_changes(Repositories& r);
  Result<Wood> wood_of(Repositories& r, const db::PanelRecord& panel);
  Result<double> area_of(Repositories& r, db::AllocationId allocation);
  // Nothing when its mask cannot be read, this time.
  Result<std::optional<double>> free_of(Repositories& r, const db::PanelRecord& panel, const std::string& live);

  const PanelLibrary& library_;
  std::mutex mutex_;
  std::unordered_map<std::int64_t, double> areas_;  // of allocations, mm2; guarded by mutex_
  std::map<PanelId, Free> free_;                    // guarded by mutex_
  std::map<PanelId, Wood> wood_;                    // guarded by mutex_
  std::int64_t seen_ = -1;                          // step of the ledger's history; guarded by mutex_
  std::map<PanelId, std::int64_t> changed_;         // wood of the panel moved until this step; guarded by mutex_
  std::map<PanelId, Booked> booked_;                // guarded by mutex_
};

}  // namespace veneer::daemon
