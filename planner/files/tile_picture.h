// A mosaic as the paper draws it: tiles in flat colours, with joints between them (Hausner 2001, section 5.1). Pure
// functions; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::planner {

// kPoint: the picture's colour at a tile's middle, for pictures of clear areas; kArea: the mean of what the tile
// covers.
enum class TileColour { kPoint, kArea };

struct TileLook {
  TileColour colour = TileColour::kArea;
  cv::Vec3b grout{118, 130, 140};  // BGR
};

// One a tile, BGR. `picture`: CV_8UC3, the artwork's, stretched over it.
std::vector<cv::Vec3b> tile_colours(const MosaicTiling& tiling, const PlanArtwork& artwork, const cv::Mat& picture,
                                    TileColour colour);

// CV_8UC3, BGR, covers exactly the artwork.
cv::Mat draw_tiles(const MosaicTiling& tiling, const PlanArtwork& artwork, const cv::Mat& picture, const TileLook& look,
                   ScanResolution resolution);
// The same as a drawing in millimetres, a polygon a tile.
std::string tiles_svg(const MosaicTiling& tiling, const PlanArtwork& artwork, const cv::Mat& picture,
                      const TileLook& look);

}  // namespace veneer::planner
