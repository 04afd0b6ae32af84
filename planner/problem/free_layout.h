// How one artwork is cut up when not into a grid.
#pragma once

#include <optional>
#include <stop_token>

#include "planner/layout/fabricable_partition.h"
#include "planner/layout/fabrication.h"
#include "planner/layout/mosaic.h"
#include "planner/layout/partition.h"
#include "planner/morph/morphed_grid.h"
#include "planner/plan.h"
#include "planner/problem/priority.h"

namespace veneer::planner {

struct FreeLayout {
  // Faces in reading order, all fabricable, and with room for their marks: patches of 6 mm or more that nobody drew.
  Partition partition;
  std::optional<MosaicFigures> mosaic;
  std::vector<MosaicTile> tiles;  // of the mosaic with joints, as Artwork::tiles_with_joints asks
  std::optional<TileFigures> tile_figures;
  std::optional<RegionFates> drawn;  // what became of areas that somebody drew
};

// What pieces keep to whose borders move: PlanOptions::min_width and, where patches are larger than
// PlanOptions::min_size, an area of its square, or half a patch if that is less: whoever asks for smaller patches wants
// them.
FabricationLimits moved_limits(const PlanOptions& options);
// What faces of a layout that is no straight grid keep to: the same, and no mere slivers of a patch.
FabricationLimits face_limits(const PlanOptions& options);
// What drawn areas keep to, whatever a patch is: they are as large as somebody wants them.
FabricationLimits drawn_limits(const PlanOptions& options);
// The disc that a cell of a morphed grid holds, and a piece whose borders are refined: its diameter.
Millimetres handy_size(const PlanOptions& options);
// How a grid of this artwork is morphed.
MorphOptions morph_options(const Artwork& artwork, const PlanOptions& options);

// Side of a patch, in pixels of the raster in which a plan's mosaic comes to rest: fewer where it has very many, or
// PlanOptions::layout_fineness is lower.
inline constexpr double kPatchPixels = 24;

// `options.layout` is kMosaic or kSegmentation; the artwork's pictures are as check_input() wants them. With a lower
// `options.layout_fineness` other cells come to rest. A pure function of these, whatever the number of threads.
// kCancelled: a stop was requested.
Result<FreeLayout> free_layout(const Artwork& artwork, const PlanOptions& options, SaliencyMaps& maps,
                               const std::stop_token& stop);

}  // namespace veneer::planner
