// The wood a plan may use.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/raster.h"
#include "base/result.h"

namespace veneer::planner {

// A part of a panel that is of one wood.
struct WoodZone {
  std::string material;
  Ring<PanelFrame> outline;
  double tone_weight = 1;  // as StockPanel::tone_weight, of the wood within
};

// One panel, seen from its show face. The two rasters may differ in resolution and extent; both lie in PanelFrame.
struct StockPanel {
  PanelId id;
  Raster<PanelFrame> picture;  // CV_8UC3, BGR
  // CV_8UC1. Non-zero: the whole square of this pixel is usable wood that nobody holds (veneer mask minus live
  // allocations, already grown by kerf and position margin). Wood outside the raster is not free. A mask made by
  // testing pixel centres against polygons is up to 0.71 pixel too generous: shrink it, or plan with a position margin.
  Raster<PanelFrame> free;
  // Where pieces of an earlier plan hold wood of `free` (KeptPiece::held): what of it is left for others, on the same
  // pixels. Empty: all of it.
  Raster<PanelFrame> open{};
  std::string material{};  // "oak"; empty: not known
  double tone_weight = 1;  // how many times its area counts when tones are mapped to the wood's; 0: not at all
  // Of a panel that is of several woods: where which of them is. Outlines may reach into each other; what lies in
  // several counts as often as the least of them says, since nobody knows whose it is.
  std::vector<WoodZone> zones{};
};

// The panels of these materials; all of them when none is named. kInvalidArgument: one of which there is no panel.
Result<std::vector<StockPanel>> only_materials(std::span<const StockPanel> stock,
                                               std::span<const std::string> materials);
// Sets tone_weight of all panels and zones of a material. kInvalidArgument: no such material, or a weight outside
// [0, 1000].
Status weigh_tones(std::span<StockPanel> stock, const std::string& material, double weight);

// kInvalidArgument: no panel and no zone is of this material.
Status is_in_stock(std::span<const StockPanel> stock, const std::string& material);

}  // namespace veneer::planner
