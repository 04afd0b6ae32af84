// How much of a panel's wood is usable, reserved and cut. Asked for again and again, so what cannot change is kept: the
// usable area with its mask (PanelRecord), the area of an allocation here; only the states are read anew.
//
// Thread-safe; reads through the connection it is given.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "base/result.h"
#include "base/units.h"
#include "daemon/services/panel_library.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

class PanelFigures {
 public:
  struct Figures {
    double usable = 0, reserved = 0, cut = 0;  // mm2
    int pieces = 0;
    bool back_known = false;
    std::optional<Millimetres> rms;
  };

  // `library` outlives this.
  explicit PanelFigures(const PanelLibrary& library) : library_(library) {}

  Result<Figures> of(Repositories& r, const db::PanelRecord& panel);

 private:
  Result<double> area_of(Repositories& r, db::AllocationId allocation);

  const PanelLibrary& library_;
  std::mutex mutex_;
  std::unordered_map<std::int64_t, double> areas_;  // of allocations, mm2; guarded by mutex_
};

}  // namespace veneer::daemon
