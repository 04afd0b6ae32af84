// What holds of every layout, as properties of rapidcheck.
#pragma once

#include <rapidcheck.h>

#include <cmath>
#include <vector>

#include "base/polygon_ops.h"
#include "planner/layout/fabrication.h"
#include "planner/layout/partition.h"

namespace veneer::planner {

// Faces cover the artwork once: each edge is used by the faces beside it, one in each direction, areas add up, and
// nothing of the artwork is left out. Areas alone would let an overlap make up for a gap.
inline void expect_exact_cover(const Partition& partition) {
  std::vector<int> forwards(partition.edges.size()), backwards = forwards;
  std::vector<Region<ArtworkFrame>> regions;
  double area = 0, covered = 0;
  for (std::size_t f = 0; f < partition.faces.size(); ++f) {
    const std::vector<DirectedEdge>& boundary = partition.faces[f].boundary;
    for (std::size_t i = 0; i < boundary.size(); ++i) {
      const DirectedEdge &it = boundary[i], &next = boundary[(i + 1) % boundary.size()];
      ++(it.backwards ? backwards : forwards)[it.edge];
      const auto &a = partition.edges[it.edge].curve, &b = partition.edges[next.edge].curve;
      RC_ASSERT((it.backwards ? a.front() : a.back()) == (next.backwards ? b.back() : b.front()));
      RC_ASSERT((it.backwards ? partition.edges[it.edge].right : partition.edges[it.edge].left) == f);
    }
    const Ring<ArtworkFrame> outline = outline_of(partition, f);
    area += signed_area(outline);
    covered += regions.emplace_back(outline).area().count();
  }
  for (std::size_t e = 0; e < partition.edges.size(); ++e) {
    RC_ASSERT(forwards[e] == (partition.edges[e].left == PartitionEdge::kOutside ? 0 : 1));
    RC_ASSERT(backwards[e] == (partition.edges[e].right == PartitionEdge::kOutside ? 0 : 1));
  }
  const Region<ArtworkFrame> artwork(
      Ring<ArtworkFrame>{{}, {partition.width, {}}, {partition.width, partition.height}, {{}, partition.height}});
  RC_ASSERT(std::abs(area - (partition.width * partition.height).count()) < 1e-6 * area);
  RC_ASSERT(std::abs(covered - artwork.area().count()) < 1e-6 * area);
  RC_ASSERT(subtract(artwork, unite(regions)).area().count() < 1e-6 * area);
}

// Simply connected, and nothing too thin or too small.
inline void expect_fabricable(const Partition& partition, const FabricationLimits& limits) {
  for (std::size_t f = 0; f < partition.faces.size(); ++f) {
    const Ring<ArtworkFrame> outline = outline_of(partition, f);
    RC_ASSERT(signed_area(outline) > 0);
    RC_ASSERT(!fault_of(outline, limits).has_value());
  }
}

}  // namespace veneer::planner
