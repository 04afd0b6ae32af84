#include "daemon/orders/artwork_guides.h"

#include <utility>

#include "daemon/orders/picture_paint.h"
#include "planner/drawings/flow_lines.h"
#include "planner/layout/layout_guides.h"
#include "planner/layout/pinned_vertices.h"

namespace veneer::daemon {

Status guide_a_grid(const std::string& large_edges, const std::string& fine_edges, const std::string& pinned_vertices,
                    planner::Artwork& artwork) {
  const auto large = edge_mask("large_edges", large_edges), fine = edge_mask("fine_edges", fine_edges);
  if (!large) return large.error();
  if (!fine) return fine.error();
  auto vertices = planner::pinned_vertices_of("pinned_vertices", pinned_vertices);
  if (!vertices) return vertices.error();
  artwork.guides.large = *large, artwork.guides.fine = *fine, artwork.guides.vertices = std::move(*vertices);
  return Ok();
}

Status guide_a_mosaic(const std::string& cell_sizes, const std::string& flow_lines, planner::Artwork& artwork) {
  const auto sizes = cell_size_mask("cell_sizes", cell_sizes);
  if (!sizes) return sizes.error();
  if (Status good = planner::check_painted_sizes(*sizes, artwork.picture.size(), artwork.name); !good) return good;
  auto drawn = planner::flow_drawing_of("flow_lines", flow_lines);
  if (!drawn) return drawn.error();
  const cv::Size picture = artwork.picture.size();
  if (drawn->page)
    if (Status good = planner::check_flow_page("flow_lines", *drawn->page, picture.width, picture.height); !good)
      return good;
  artwork.guides.cell_sizes = *sizes, artwork.guides.flow_lines = std::move(drawn->lines);
  return Ok();
}

Status weigh(const std::string& importance, planner::Artwork& artwork) {
  const auto mask = importance_mask("importance", importance);
  if (!mask) return mask.error();
  artwork.importance = *mask;
  return Ok();
}

}  // namespace veneer::daemon
