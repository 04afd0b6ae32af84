// How much of a panel's wood is usable, free, reserved and cut. Asked for again and again, so what cannot change is
// kept: the usable area with its mask (PanelRecord), the area of an allocation and what a mask leaves free beside the
// live allocations here; only the states are read anew.
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
    bool back_known = false;
    std::optional<Millimetres> rms;
  };

  // `library` outlives this.
  explicit PanelFigures(const PanelLibrary& library) : library_(library) {}

  Result<Figures> of(Repositories& r, const db::PanelRecord& panel);

 private:
  struct Free {
    std::string of;  // the mask and the live allocations that it was counted for
    double area = 0;
  };
  Result<double> area_of(Repositories& r, db::AllocationId allocation);
  Result<double> free_of(Repositories& r, const db::PanelRecord& panel, const std::string& live);

  const PanelLibrary& library_;
  std::mutex mutex_;
  std::unordered_map<std::int64_t, double> areas_;  // of allocations, mm2; guarded by mutex_
  std::map<PanelId, Free> free_;                    // guarded by mutex_
};

}  // namespace veneer::daemon
