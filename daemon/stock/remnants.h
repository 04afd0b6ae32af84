// What is left of a panel: how much free wood of each kind, what fits into it, and where it lies. Asked for again and
// again: what is counted is kept until the mask, what is booked or the zones' materials change. What was booked of that
// (remnant_clerk.h) need not be counted; what searches ask for is in the stock's memory.
//
// Thread-safe; reads through the connection it is given, and files: on a thread that may wait for the disk.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/stock/inscribed.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/stock_memory.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

// Free wood of one material; "" where nobody has said.
struct RemnantWood {
  std::string material;
  SquareMillimetres free{0};
};

struct Remnant {
  // By name; what may belong to two zones is left out, so that they are a little less than what is free.
  std::vector<RemnantWood> woods;
  std::optional<InscribedSquare> square;  // nothing when no wood is free
  std::optional<InscribedCircle> circle;
};

// CIE L* of what counts as dark and light wood: walnut lies below, maple above, oak and cherry between them.
inline constexpr double kDarkAtMost = 50, kLightAtLeast = 65;
enum class Tone { kDark, kLight };

// Wood that somebody looks for: what squares of `patch` cover of it.
struct WoodWanted {
  std::optional<std::string> material;  // of zones
  std::optional<Tone> tone;             // all over such a square, of 3 x 3 mm together
  Millimetres patch{0};                 // a pixel at least
  friend bool operator==(const WoodWanted&, const WoodWanted&) = default;
};

// By which it is kept and booked what a search found.
std::string name_of(const WoodWanted& wanted);

// As it is booked, and read from the book again.
Remnant remnant_of(const db::RemnantRecord& booked);
db::RemnantRecord to_record(const PanelId& panel, int mask_version, const std::string& counted_of,
                            const Remnant& remnant);

class Remnants {
 public:
  // `library` and `memory` outlive this.
  Remnants(const PanelLibrary& library, StockMemory& memory) : library_(library), memory_(memory) {}

  struct Counted {
    std::string of;  // names mask, live allocations and materials: as db::RemnantRecord::counted_of
    Remnant remnant;
    bool booked = false;  // as the newest remnant that was booked
  };
  // Nothing when the panel's mask cannot be read.
  Result<std::optional<Counted>> count(Repositories& r, const db::PanelRecord& panel);
  Result<std::optional<Remnant>> of(Repositories& r, const db::PanelRecord& panel);
  // Whether that is told without a look at the mask, which takes long.
  Result<bool> knows(Repositories& r, const db::PanelRecord& panel);
  // How much of the wanted wood it has; none when its pictures cannot be read. Its mask is looked at once for each kind
  // of wood, whatever the patches' sides.
  Result<SquareMillimetres> fitting(Repositories& r, const db::PanelRecord& panel, const WoodWanted& wanted);
  // Whether what that looks at could be read when it was looked at last.
  bool is_readable(const db::PanelRecord& panel, const WoodWanted& wanted);
  // What is asked once for all panels that are searched together.
  struct Asked {
    std::int64_t newest = 0;                               // as StockMemory::newest_step() tells it
    std::map<PanelId, std::vector<db::ZoneRecord>> zones;  // without their outlines; none of panels without zones
  };
  Result<Asked> ask(Repositories& r);
  // Nothing when that is not counted yet and nobody is to look, or when its pictures cannot be read.
  Result<std::optional<SquareMillimetres>> fitting(Repositories& r, const db::PanelRecord& panel,
                                                   const WoodWanted& wanted, const Asked& asked, Look look);
  // Counts now what fitting() would have to look at the mask for, of whatever wood. How many kinds it had to count.
  Result<int> count_for_searches(Repositories& r, const db::PanelRecord& panel);
  // What is booked with a remnant: wood of any tone in patches of the usual side.
  static std::vector<WoodWanted> usual_searches();

 private:
  Result<std::optional<SquareMillimetres>> booked_fitting(Repositories& r, const db::PanelRecord& panel,
                                                          const std::string& counted_of, const std::string& search);
  // In memory, or in the book.
  Result<std::optional<Counted>> known(Repositories& r, const PanelId& panel, const std::string& of);

  const PanelLibrary& library_;
  StockMemory& memory_;
  std::mutex mutex_;
  std::map<PanelId, Counted> kept_;  // guarded by mutex_
};

// What a picture of a remnant shows beside the free wood. On paper nothing: of the panel's tags, small as they are, the
// scanner and the camera would read the numbers, and take the picture for the panel.
enum class Beside { kPale, kBlank };
// draw_remnant() of the library's small copies, at most `width_px` wide.
Result<cv::Mat> picture_of_remnant(const PanelLibrary& library, const db::PanelRecord& panel,
                                   const std::vector<db::AllocationRecord>& live, const Remnant& remnant, int width_px,
                                   Beside beside = Beside::kPale);
// The veneer map in its colours where wood is free, with the largest square and circle drawn in.
// `mask`: of the map's size, 128 and more = usable.
cv::Mat draw_remnant(const Raster<PanelFrame>& map, const cv::Mat& mask, const std::vector<Region<PanelFrame>>& live,
                     const Remnant& remnant, Beside beside = Beside::kPale);

}  // namespace veneer::daemon
