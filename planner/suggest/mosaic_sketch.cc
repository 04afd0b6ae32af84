#include "planner/suggest/mosaic_sketch.h"

#include <fmt/format.h>

#include "planner/plan_options.h"
#include "planner/problem/free_layout.h"
#include "planner/problem/problem.h"

namespace veneer::planner {
namespace {

constexpr double kRoughPatchPixels = 10;  // of a patch's side: a third of the time, and directions still show

}  // namespace

Result<MosaicPreview> sketch_mosaic(const Artwork& artwork, const PlanOptions& options, GridEffort effort,
                                    const std::stop_token& stop) {
  if (options.layout != LayoutKind::kMosaic) return unusable("only a mosaic has cells: choose that layout");
  if (Status status = check_options(options); !status.ok()) return status.error();
  if (Status status = check_artwork(artwork, options); !status.ok()) return status.error();
  const GridSize size = grid_size(artwork.width, artwork.height, options.patch);
  const double cells = static_cast<double>(size.rows) * size.columns;
  if (cells > kMostSketchedCells)
    return unusable(
        fmt::format("the mosaic would have {:.0f} pieces, and its cells are shown of at most {}: choose larger "
                    "patches, or plan it as it is",
                    cells, kMostSketchedCells));
  SaliencyMaps maps;
  const auto made =
      free_layout(artwork, options, maps, stop, effort == GridEffort::kCoarse ? kRoughPatchPixels : kPatchPixels);
  if (!made.ok()) return made.error();
  MosaicPreview out{made->partition.faces.size(), {}};
  for (const PartitionEdge& edge : made->partition.edges)
    if (edge.left != PartitionEdge::kOutside && edge.right != PartitionEdge::kOutside)
      out.lines.push_back(flattened(edge));
  return out;
}

}  // namespace veneer::planner
