// The wood that a new job may use: free wood of the panels and kinds it asks for.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "base/units.h"
#include "db/materials.h"
#include "planner/edits/plan_edits.h"
#include "planner/stock.h"

namespace veneer::daemon {

// A panel of the stock, as the database and the data folder know it.
struct HeldPanel {
  PanelId id;
  std::string map, mask;                 // files
  std::vector<Region<PanelFrame>> live;  // of its live allocations
  std::vector<db::ZoneRecord> zones;
  std::vector<Region<PanelFrame>> spared;  // what lead-ins keep off even where no piece lies: tags, holes
  // Of a job whose pieces are made again, whose plan was made on `map` and `mask`: the mask that counts now ("" of any
  // other job), what the job itself holds, which is not in `live`, and whether the panel is out of stock.
  std::string mask_now;
  std::vector<Region<PanelFrame>> own;
  bool closed = false;
  bool remnant = false;  // wood was cut from it, or it is a part of another panel
};

// How many times the picture's area the chosen panels offer, where remnants alone could.
inline constexpr double kEnoughWood = 2;

struct JobWood {
  std::vector<HeldPanel> panels;
  Millimetres margin{0};                                     // what is allocated is grown by it
  std::vector<std::string> woods;                            // materials of zones; empty: all wood
  std::vector<std::pair<std::string, double>> wood_weights;  // how many times a wood's area counts in its tones
  std::vector<std::pair<std::string, double>> wood_limits;   // the most that a wood may be of the picture's area
  std::vector<planner::ForbiddenWood> forbidden;
  // No more panels: those with the most free wood of the kinds asked for, remnants before fresh panels where
  // `remnants_first` asks for it. While the remnants among them offer less than kEnoughWood times the picture, panels
  // with more wood take the place of the smallest.
  std::optional<std::size_t> max_panels;
  // Asked for: no fresh panel is offered but those that the remnants' lack of wood makes up for, and those that hold
  // the job's own wood. Not said: no.
  std::optional<bool> remnants_first;
  std::string index_dir;  // where the planner keeps what it measured of panels
};

// Mask minus live allocations grown by `margin`. With `woods` a panel offers its zones of these materials only, and
// none of the wood that another zone may reach into; its material is the one it offers, "" when there are
// several, each then in zones of its own, or nobody has said. Forbidden wood is not free. Indexes of panels that are
// used up are dropped. A panel with `mask_now` offers its free wood as the job found it (StockPanel::free), and what is
// left of it (StockPanel::open). `picture`: the area of the artwork.
//
// Blocks on files. kNotFound: wood is forbidden on a panel that is not among these. kInvalidArgument: no panel has a
// wood that is asked for or weighed; forbidden wood lies beside its panel. kStorage: a panel's pictures cannot be read.
Result<std::vector<planner::StockPanel>> load_job_wood(const JobWood& wood, SquareMillimetres picture);

// Where the panels' pictures come from: the map, and the mask minus live allocations grown by a margin.
struct WoodPictures {
  std::function<Result<Raster<PanelFrame>>(const HeldPanel&)> map;
  std::function<Result<Raster<PanelFrame>>(const HeldPanel&, Millimetres margin)> free;
};
// The files themselves, in full.
WoodPictures stored_wood();
// The same with pictures from elsewhere, of panels without `mask_now`.
Result<std::vector<planner::StockPanel>> load_job_wood(const JobWood& wood, SquareMillimetres picture,
                                                       const WoodPictures& pictures);

}  // namespace veneer::daemon
