// A planning problem at the working resolution: everything the matcher needs, checked.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "planner/layout/grid.h"
#include "planner/layout/piece_marks.h"
#include "planner/matching/cell_index.h"
#include "planner/matching/matcher.h"
#include "planner/pictures/working_pictures.h"
#include "planner/plan.h"
#include "planner/problem/material_limits.h"

namespace veneer::planner {

class SaliencyMaps;  // priority.h
struct TaskTree;

struct Problem {
  std::vector<MatchPanel> panels;
  std::vector<WorkingArtwork> artworks;
  std::vector<WindowClass> classes;
  std::vector<std::string> warnings;
  struct Task {
    std::size_t artwork, patch;
    MatchPatch match;
    double importance = 1;  // mean over the patch: what its cost weighs where patches compete
  };
  // In the order in which patches choose. MatchPatch::features points into `artworks`, so a Problem is moved, never
  // copied.
  std::vector<Task> queue;
  // With adaptive levels: squares, in the order in which they choose (greedy/adaptive.h). The queue has patches then
  // only of artworks whose sizes an earlier plan has fixed, and none after keep_pieces().
  std::vector<TaskTree> squares;
  PieceMarks marks;
  double entries_per_unit = 1;
  MaterialLimits limits;
  std::optional<MosaicReport> mosaic;
  std::vector<MosaicTiling> tilings;
  std::optional<SegmentationReport> segmentation;
  std::optional<MorphReport> morph;

  Problem();
  Problem(Problem&&) noexcept;
  Problem& operator=(Problem&&) noexcept;
  ~Problem();
};

// A patch and the smaller ones it may be cut into.
struct TaskTree {
  Problem::Task task;
  std::vector<TaskTree> parts;
};

// The placement of a patch of the queue: where it is cut from.
struct PatchPlacement {
  int panel = 0;
  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork;
  double cost = 0;  // equation 4
};
using PatchPlacements = std::vector<std::optional<PatchPlacement>>;  // one a task of the queue; none: unfilled

inline constexpr int kSmallestPatch = 3;  // working pixels

// kInvalidArgument: see make_plan. Of one artwork without its wood, and of all; without looking at a pixel.
Status check_artwork(const Artwork& artwork, const PlanOptions& options);
Status check_input(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options);
// The same, and kCancelled: within some tens of milliseconds of the stop request. `doing`, if given, gets a short
// phrase, on the calling thread, before what takes seconds.
Result<Problem> make_problem(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                             const PlanOptions& options, const std::stop_token& stop = {}, SaliencyMaps* maps = nullptr,
                             const std::function<void(std::string_view)>& doing = {});

// Rotations k * 360 / n degrees.
std::vector<Radians> turns(int rotations);
// Whether a rectangle fits into another in one of these rotations.
bool fits(Millimetres width, Millimetres height, Millimetres into_width, Millimetres into_height,
          const std::vector<Radians>& turns);

}  // namespace veneer::planner
