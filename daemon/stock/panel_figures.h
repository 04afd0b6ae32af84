// How much of a panel's wood is usable, free, reserved and cut: its area book, which all that people are shown follows,
// and what a plan may use of it, a little less. Asked for again and again, so what has not changed is kept: the usable
// area with its mask (PanelRecord); the book and what is free in the stock's memory; here the areas of some
// allocations, and what each allocation takes of a mask's wood for the panels last looked at.
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
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "daemon/stock/area_book.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/stock_memory.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

// What is known of a panel's mask, from which all that is said of its wood follows.
enum class MaskCount {
  kCounted,
  kUncounted,   // nobody has looked at it since its wood changed
  kUnreadable,  // its file is lost or damaged
};
const char* to_string(MaskCount count);

class PanelFigures {
 public:
  struct Figures {
    MaskCount mask = MaskCount::kUncounted;
    std::optional<AreaBook> book;  // what each square millimetre of it is; of a mask that is counted
    std::optional<double> usable;  // mm2, of the newest mask, whether allocated or not
    // mm2, of that what nothing live is booked on, in whole pixels: what a plan may use. Nothing when nobody knows.
    std::optional<double> free;
    double reserved = 0, cut = 0;  // mm2, booked; kerf, suspect wood and scrap included
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
  Result<Figures> of(Repositories& r, const db::PanelRecord& panel, const Asked& asked, Look look);
  // As Figures tell it; 0 when its mask cannot be read, since no plan can use it.
  Result<double> free(Repositories& r, const db::PanelRecord& panel);
  Result<std::optional<double>> free(Repositories& r, const db::PanelRecord& panel, std::int64_t newest, Look look);
  // Looks at its mask where it may and that has to be, so that of() need not.
  Result<MaskCount> count(Repositories& r, const db::PanelRecord& panel, std::int64_t newest, Look look);
  // What each square millimetre of it is; nothing when its mask cannot be read.
  Result<std::optional<AreaBook>> book(Repositories& r, const db::PanelRecord& panel);
  // Whether all of this is told without a look at its mask.
  Result<bool> knows(Repositories& r, const db::PanelRecord& panel);

 private:
  // What is booked, and what that leaves of a mask.
  struct Wood {
    std::optional<AreaBook> book;
    std::optional<double> free;    // mm2; of a panel without pieces all that is usable
    double reserved = 0, cut = 0;  // mm2
    int pieces = 0;
  };
  struct Booked {
    std::string mask_file;
    MaskedWood panel;
    std::unordered_map<std::int64_t, BookedWood> wood;  // by allocation
  };
  using Live = std::vector<std::pair<db::AllocationId, db::AllocationState>>;
  class Mask;
  // As the stock's memory keeps it, of wood with a book, and back.
  static std::vector<double> to_numbers(const Wood& wood);
  static Wood kept_wood(const std::vector<double>& numbers);
  Result<Wood> wood_of(Repositories& r, const db::PanelRecord& panel, std::int64_t newest, Look look);
  Result<double> area_of(Repositories& r, db::AllocationId allocation);
  Result<std::optional<double>> usable_of(const db::PanelRecord& panel, Mask& mask);
  struct Free {
    double area = 0;   // mm2
    std::string wood;  // StockMemory::State::wood of what it was counted of
  };
  // Of the wood so named, or of what is free by now; nothing when the mask cannot be read, this time.
  Result<std::optional<Free>> free_of(Repositories& r, const db::PanelRecord& panel, const std::string& wood,
                                      Mask& mask);
  Result<std::optional<AreaBook>> book_of(Repositories& r, const db::PanelRecord& panel, const Live& live, Mask& mask);
  Booked booked_on(const db::PanelRecord& panel);
  void keep_booked(const PanelId& panel, const Booked& booked);
  MaskCount counted(const db::PanelRecord& panel, const Wood& wood);

  const PanelLibrary& library_;
  StockMemory& memory_;
  std::mutex mutex_;
  std::unordered_map<std::int64_t, double> areas_;  // of allocations, mm2; guarded by mutex_
  std::list<std::pair<PanelId, Booked>> booked_;    // the last one asked for first; guarded by mutex_
};

}  // namespace veneer::daemon
