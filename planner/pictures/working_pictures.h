// Panels and artworks at the working resolution: features, free wood, mapped tones. Pure functions.
#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "planner/boundaries/cut_lines.h"
#include "planner/layout/grid.h"
#include "planner/layout/partition.h"
#include "planner/matching/lattice.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"

namespace veneer::planner {

struct WorkingArtwork {
  PixelGrid grid;
  cv::Mat features;  // CV_32FC(n), after gamut mapping
  cv::Mat tones;     // CV_8UC1: the intensity that is looked for, after gamut mapping; 255 = white
  cv::Mat grain;     // which way the picture would like grain to run (grain/grain_field.h); empty unless it counts
  std::vector<Patch> patches;
  std::optional<Partition> layout;  // a face for each patch, in their order; none: a straight grid
  std::optional<CutLines> lines;    // of a morphed grid, in pixels of `grid`; faces as in `layout`
};

struct WorkingPictures {
  std::vector<MatchPanel> panels;
  std::vector<WorkingArtwork> artworks;  // without patches
  std::vector<std::string> warnings;     // of pictures that do not suit the options
};

// Tones of all artworks are mapped to the wood that is free now on these panels, each by its area times its tone
// weight. kInvalidArgument: there is no free wood at all. kCancelled: some rows of a picture after the stop request.
Result<WorkingPictures> working_pictures(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                                         const PlanOptions& options, const std::stop_token& stop = {});

}  // namespace veneer::planner
