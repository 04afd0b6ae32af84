// What somebody painted and drew over a picture, in a request's words, as a layout of its artwork is guided by it.
// Pure; kInvalidArgument: a word is none of those.
#pragma once

#include <string>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::daemon {

// Of a morphed grid: edge_mask() of both (picture_paint.h), and planner::pinned_vertices_of() of what is pinned.
Status guide_a_grid(const std::string& large_edges, const std::string& fine_edges, const std::string& pinned_vertices,
                    planner::Artwork& artwork);
// Of a mosaic: cell_size_mask() and planner::flow_drawing_of(), both of which must suit the artwork's picture.
Status guide_a_mosaic(const std::string& cell_sizes, const std::string& flow_lines, planner::Artwork& artwork);
Status weigh(const std::string& importance, planner::Artwork& artwork);  // importance_mask()

// All that an order says of its layout. Other layouts heed no guides, and refuse them.
template <class Order>
Status guide(const Order& order, planner::Artwork& artwork) {
  if (Status weighed = weigh(order.importance, artwork); !weighed) return weighed;
  const auto layout = order.options.find("layout");
  if (layout == order.options.end()) return Ok();
  if (layout->second == "morph")
    return guide_a_grid(order.large_edges, order.fine_edges, order.pinned_vertices, artwork);
  if (layout->second == "mosaic") return guide_a_mosaic(order.cell_sizes, order.flow_lines, artwork);
  return Ok();
}

}  // namespace veneer::daemon
