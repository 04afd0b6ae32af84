#include "daemon/orders/grid_work.h"

#include <cmath>
#include <utility>

#include "daemon/orders/artwork_file.h"
#include "daemon/orders/artwork_guides.h"
#include "daemon/orders/kept_edges.h"
#include "planner/plan_options.h"
#include "planner/suggest/grid_sketch.h"
#include "planner/suggest/mosaic_sketch.h"

namespace veneer::daemon {
namespace {

DrawnPlace place_of(const Point<ArtworkFrame>& at) {
  const auto rounded = [](Millimetres value) { return std::round(value.count() * 100) / 100; };
  return {rounded(at.x), rounded(at.y)};
}

std::vector<std::vector<DrawnPlace>> places_of(const std::vector<std::vector<Point<ArtworkFrame>>>& lines) {
  std::vector<std::vector<DrawnPlace>> out;
  for (const auto& line : lines) {
    auto& drawn = out.emplace_back();
    for (const auto& at : line) drawn.push_back(place_of(at));
  }
  return out;
}

Result<planner::PlanOptions> options_of(const std::map<std::string, std::string>& texts) {
  planner::PlanOptions out;
  for (const auto& [name, text] : texts)
    if (const Status set = planner::set_option(out, name, text); !set) return set.error();
  out.threads = 1;  // somebody else may be planning
  return out;
}

planner::GridEffort effort_of(bool fine) { return fine ? planner::GridEffort::kFine : planner::GridEffort::kCoarse; }

}  // namespace

Result<GridDrawn> draw_grid(const DrawGrid& order, const std::filesystem::path&, const TaskProgress&) {
  auto artwork = read_artwork({order.picture}, order.name, order.crop, order.size);
  if (!artwork) return artwork.error();
  if (const Status guided = guide_a_grid(order.large_edges, order.fine_edges, order.pinned_vertices, *artwork); !guided)
    return guided.error();
  const auto options = options_of(order.options);
  if (!options) return options.error();
  const auto effort = effort_of(order.fine);
  const auto made = planner::sketch_grid(*artwork, *options, effort, {}, kept_edges(order.kept_dir, effort));
  if (!made) return made.error();
  GridDrawn out{artwork->width.count(), artwork->height.count(), made->size.rows, made->size.columns, {},
                places_of(made->lines)};
  for (const auto& vertex : made->vertices) out.vertices.push_back(place_of(vertex));
  return out;
}

Result<MosaicDrawn> draw_mosaic(const DrawMosaic& order, const std::filesystem::path&, const TaskProgress&) {
  auto artwork = read_artwork({order.picture}, order.name, order.crop, order.size);
  if (!artwork) return artwork.error();
  if (const Status guided = guide_a_mosaic(order.cell_sizes, order.flow_lines, *artwork); !guided)
    return guided.error();
  if (const Status weighed = weigh(order.importance, *artwork); !weighed) return weighed.error();
  const auto options = options_of(order.options);
  if (!options) return options.error();
  const auto made = planner::sketch_mosaic(*artwork, *options, effort_of(order.fine));
  if (!made) return made.error();
  return MosaicDrawn{artwork->width.count(), artwork->height.count(), made->cells, places_of(made->lines)};
}

}  // namespace veneer::daemon
