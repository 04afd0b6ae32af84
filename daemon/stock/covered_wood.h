// How much of some wood patches can cover, for every size of patch at once: what a search asks of a panel. Small, since
// only the sizes are kept with which it changes. A value; pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/raster.h"

namespace veneer::daemon {

class CoveredWood {
 public:
  // Counts it: what takes long. Non-zero = free.
  explicit CoveredWood(const Raster<PanelFrame>& free);

  // All that free squares of this side, rounded up to whole pixels, can cover, sides along the panel's.
  SquareMillimetres by(Millimetres side) const;

  // As the stock's memory keeps it (stock_memory.h): "11.811 23:118092 1:4761 3:529", pixels to the millimetre, then
  // by how many pixels patches grow, and how many pixels of wood those cover that no larger ones do. Nothing when the
  // text is no such thing.
  std::string text() const;
  static std::optional<CoveredWood> read(std::string_view text);

 private:
  struct Step {
    int side = 0;             // squares of so many pixels
    std::int64_t pixels = 0;  // and smaller ones, down to the step before, cover so many
  };
  CoveredWood() = default;

  ScanResolution resolution_{1};
  std::vector<Step> steps_;  // sides grow, pixels become less
};

}  // namespace veneer::daemon
