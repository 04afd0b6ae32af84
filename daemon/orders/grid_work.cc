#include "daemon/orders/grid_work.h"

#include <cmath>
#include <utility>

#include "daemon/orders/artwork_file.h"
#include "daemon/orders/picture_paint.h"
#include "planner/plan_options.h"
#include "planner/suggest/grid_sketch.h"

namespace veneer::daemon {
namespace {

GridDrawn::Place place_of(const Point<ArtworkFrame>& at) {
  const auto rounded = [](Millimetres value) { return std::round(value.count() * 100) / 100; };
  return {rounded(at.x), rounded(at.y)};
}

}  // namespace

Result<GridDrawn> draw_grid(const DrawGrid& order, const std::filesystem::path&, const TaskProgress&) {
  auto artwork = read_artwork({order.picture}, order.name, order.crop, order.size);
  if (!artwork) return artwork.error();
  const auto large = edge_mask("large_edges", order.large_edges), fine = edge_mask("fine_edges", order.fine_edges);
  if (!large) return large.error();
  if (!fine) return fine.error();
  auto vertices = planner::pinned_vertices_of("pinned_vertices", order.pinned_vertices);
  if (!vertices) return vertices.error();
  artwork->guides.large = *large, artwork->guides.fine = *fine, artwork->guides.vertices = std::move(*vertices);
  planner::PlanOptions options;
  for (const auto& [name, text] : order.options)
    if (const Status set = planner::set_option(options, name, text); !set) return set.error();
  options.threads = 1;  // somebody else may be planning
  const auto effort = order.fine ? planner::GridEffort::kFine : planner::GridEffort::kCoarse;
  const auto made = planner::sketch_grid(*artwork, options, effort);
  if (!made) return made.error();
  GridDrawn out{artwork->width.count(), artwork->height.count(), made->size.rows, made->size.columns, {}, {}};
  for (const auto& vertex : made->vertices) out.vertices.push_back(place_of(vertex));
  for (const auto& line : made->lines) {
    auto& drawn = out.lines.emplace_back();
    for (const auto& at : line) drawn.push_back(place_of(at));
  }
  return out;
}

}  // namespace veneer::daemon
