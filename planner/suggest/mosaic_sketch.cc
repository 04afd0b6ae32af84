#include "planner/suggest/mosaic_sketch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/plan_options.h"
#include "planner/problem/free_layout.h"
#include "planner/problem/problem.h"

namespace veneer::planner {
namespace {

// How finely tiles come to rest: pixels of a patch's side, and of all patches together, but for the least of a side.
struct TileRaster {
  double patch_pixels, pixels;
};
constexpr TileRaster kRoughTiles{10, 7e4}, kFineTiles{kPatchPixels, 4e5};  // some 0.3 and 1 to 4 s of processor time

double fineness(GridEffort effort, double patches) {
  const TileRaster& most = effort == GridEffort::kCoarse ? kRoughTiles : kFineTiles;
  return std::min(std::sqrt(most.pixels / patches), most.patch_pixels) / kPatchPixels;
}

// Without the points that nobody sees: a plan's borders have several a millimetre.
Polyline<ArtworkFrame> seen(const Polyline<ArtworkFrame>& line, Millimetres longer_side) {
  constexpr double kSeen = 1.0 / 3000;
  std::vector<cv::Point2f> points, kept;
  for (const auto& at : line) points.emplace_back(static_cast<float>(at.x.count()), static_cast<float>(at.y.count()));
  cv::approxPolyDP(points, kept, longer_side.count() * kSeen, false);
  Polyline<ArtworkFrame> out;
  for (const cv::Point2f& at : kept) out.push_back(point<ArtworkFrame>(at.x, at.y));
  return out;
}

}  // namespace

double rough_fineness(double patches) { return fineness(GridEffort::kCoarse, patches); }

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
  PlanOptions wanted = options;
  wanted.layout_fineness = fineness(effort, cells);
  const auto made = free_layout(artwork, wanted, maps, stop);
  if (!made.ok()) return made.error();
  MosaicPreview out{made->partition.faces.size(), {}};
  for (const PartitionEdge& edge : made->partition.edges)
    if (edge.left != PartitionEdge::kOutside && edge.right != PartitionEdge::kOutside)
      out.lines.push_back(seen(flattened(edge), std::max(artwork.width, artwork.height)));
  return out;
}

}  // namespace veneer::planner
