// How a picture would about look in the wood that there is, quickly enough to follow a slider.
//
// Wood is chosen as a plan chooses it, but at a resolution at which a patch is some ten pixels wide, among few places
// and rotations; the picture is drawn from the panels' pictures with what was chosen. No wood is used twice.
#pragma once

#include <chrono>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "planner/plan.h"
#include "planner/suggest/grid_sketch.h"

namespace veneer::planner {

// The resolution of the panels' pictures from which a sketch chooses and draws; finer ones only take longer.
inline constexpr double kSketchDpi = 75;

struct PictureSketch {
  Plan plan;                              // its resolution is the sketch's own
  LayoutKind layout = LayoutKind::kGrid;  // that it was drawn in
  Millimetres patch;                      // that it was drawn with: larger than asked for where there would be too many
  double likeness = 0;                    // as Suggestion::likeness
  // Estimated, with the recipe of cut files; none of larger patches than asked for, which are quicker to cut.
  std::optional<std::chrono::duration<double>> cutting;
  cv::Mat preview;  // CV_8UC3, at kSketchDpi or coarser; unfilled patches are magenta
  // Sentences that a person should hear: that the wood is short, that patches are drawn larger.
  std::vector<std::string> remarks;
};

// `options` are those of the plan to come; resolution, rotations and how wood is chosen are the sketch's own. kCoarse
// follows a hand: squares, whatever the layout, so that the artwork must have no guides. kFine has the plan's layout,
// rougher, and its refined borders, and takes several times as long. kInvalidArgument: as make_plan, and where vertices
// are pinned in a grid of more pieces than are drawn. kCancelled: a stop was requested. Deterministic.
Result<PictureSketch> sketch_picture(const Artwork& artwork, std::span<const StockPanel> stock,
                                     const PlanOptions& options, GridEffort effort = GridEffort::kCoarse,
                                     const std::stop_token& stop = {});

}  // namespace veneer::planner
