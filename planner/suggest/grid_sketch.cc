#include "planner/suggest/grid_sketch.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "planner/morph/morphed_grid.h"
#include "planner/problem/free_layout.h"

namespace veneer::planner {
namespace {

// Lines are seen no finer on any screen, and a plan of some 600 mm at 75 dpi has no more.
constexpr double kMostWorkingPixels = 1800;

}  // namespace

Result<GridPreview> sketch_grid(const Artwork& artwork, const PlanOptions& options, GridEffort effort,
                                const std::stop_token& stop, const EdgeFinder& edges) {
  const GridSize size = grid_size(artwork.width, artwork.height, options.patch);
  const double cells = static_cast<double>(size.rows) * size.columns;
  if (cells > kMostSketchedCells)
    return unusable(
        fmt::format("the grid would have {:.0f} pieces, and its lines are shown of at most {}: choose larger patches, "
                    "or plan it as it is",
                    cells, kMostSketchedCells));
  MorphOptions wanted = morph_options(artwork, options);
  wanted.edges = edges;
  if (effort == GridEffort::kCoarse) return coarse_grid(artwork.picture, artwork.width, artwork.height, wanted, stop);
  const double longer = std::max(artwork.width, artwork.height).count();
  const double planned = ScanResolution::from_dpi(options.dpi).px_per_mm;
  const PixelGrid grid{ScanResolution{std::min(planned, kMostWorkingPixels / longer)}, artwork.height};
  cv::Mat tones;
  cv::cvtColor(artwork.picture, tones, cv::COLOR_BGR2GRAY);
  Result<MorphedGrid> made = morphed_grid(artwork.picture, tones, artwork.width, grid, wanted, stop);
  if (!made.ok()) return made.error();
  return grid_preview(made->lines, size, artwork.width, artwork.height);
}

}  // namespace veneer::planner
