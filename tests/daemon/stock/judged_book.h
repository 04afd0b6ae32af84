// An area book held against both counts of tests/support/panel_areas.h.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/raster.h"
#include "daemon/stock/area_book.h"
#include "tests/support/panel_areas.h"

namespace veneer::daemon {

inline testing::PlainRing plain_ring(const Ring<PanelFrame>& ring) {
  testing::PlainRing out;
  for (const auto& p : ring) out.emplace_back(p.x.count(), p.y.count());
  return out;
}
inline std::vector<testing::PlainWood> plain_wood(const std::vector<db::AllocationRecord>& allocations) {
  std::vector<testing::PlainWood> out;
  for (const db::AllocationRecord& a : allocations) {
    testing::PlainWood& wood = out.emplace_back(testing::PlainWood{to_string(a.state), {}, plain_ring(a.outline)});
    for (const auto& ring : a.area.rings()) wood.area.push_back(plain_ring(ring));
  }
  return out;
}
inline nlohmann::json plain_book(const AreaBook& book) {
  return {{"panel", book.panel.count()}, {"free", book.free.count()},        {"reserved", book.reserved.count()},
          {"cut", book.cut.count()},     {"kerf", book.kerf.count()},        {"suspect", book.suspect.count()},
          {"scrap", book.scrap.count()}, {"unusable", book.unusable.count()}};
}

// "" where the book is what the ledger's rows and the mask say, else a sentence; by points, too, where `by_points`.
inline std::string judged(const AreaBook& book, const std::vector<db::AllocationRecord>& allocations,
                          const Raster<PanelFrame>& mask, Millimetres width, Millimetres height, bool by_points) {
  return testing::disagreement(plain_book(book), plain_wood(allocations), {mask.pixels, 1 / mask.resolution.px_per_mm},
                               width.count(), height.count(), by_points);
}

}  // namespace veneer::daemon
