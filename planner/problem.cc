#include "planner/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "planner/features.h"
#include "planner/kernels.h"
#include "planner/order.h"

namespace veneer::planner {
namespace {

constexpr int kSmallestPatch = 3;  // working pixels

Error unusable(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message)}; }

// Windows of patches that differ by the rounding of their borders share a class.
WindowClass common_class(const std::vector<MatchPatch>& patches) {
  WindowClass out;
  out.width = patches.front().pixels.width, out.height = patches.front().pixels.height;
  out.left = out.top = -1e9, out.right = out.bottom = 1e9;
  for (const MatchPatch& patch : patches) {
    out.width = std::min(out.width, patch.pixels.width), out.height = std::min(out.height, patch.pixels.height);
    const ScanResolution& resolution = patch.grid.resolution;
    const Box<ArtworkFrame> box = bounds(patch.outline);
    out.left = std::max(out.left, resolution.to_px(box.min.x).count() - patch.pixels.left);
    out.right = std::min(out.right, resolution.to_px(box.max.x).count() - patch.pixels.left);
    out.top = std::max(out.top, resolution.to_px(patch.grid.height - box.max.y).count() - patch.pixels.top);
    out.bottom = std::min(out.bottom, resolution.to_px(patch.grid.height - box.min.y).count() - patch.pixels.top);
  }
  out.x = choose_blocks(out.width), out.y = choose_blocks(out.height);
  return out;
}

bool fits_somewhere(const Ring<ArtworkFrame>& outline, const Problem& problem, const std::vector<Radians>& all_turns) {
  const Box<ArtworkFrame> box = bounds(outline);
  for (const MatchPanel& panel : problem.panels) {
    const double margin = 2 * panel.wood.border().count();
    const double w = box.width().count() + margin, h = box.height().count() + margin;
    for (const Radians turn : all_turns) {
      const double c = std::abs(std::cos(turn.count())), s = std::abs(std::sin(turn.count()));
      if (w * c + h * s <= panel.features.width().count() && w * s + h * c <= panel.features.height().count())
        return true;
    }
  }
  return false;
}

std::size_t class_index(std::vector<WindowClass>& classes, const WindowClass& wanted) {
  for (std::size_t i = 0; i < classes.size(); ++i) {
    WindowClass& it = classes[i];
    if (it.width != wanted.width || it.height != wanted.height) continue;
    it.left = std::max(it.left, wanted.left), it.right = std::min(it.right, wanted.right);
    it.top = std::max(it.top, wanted.top), it.bottom = std::min(it.bottom, wanted.bottom);
    return i;
  }
  classes.push_back(wanted);
  return classes.size() - 1;
}

}  // namespace

std::vector<Radians> turns(int rotations) {
  std::vector<Radians> out;
  for (int k = 0; k < rotations; ++k) out.push_back(degrees(360.0 * k / rotations));
  return out;
}

Result<Problem> make_problem(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                             const PlanOptions& options) {
  if (Status status = check_input(artworks, stock, options); !status.ok()) return status.error();
  Result<WorkingPictures> pictures = working_pictures(artworks, stock, options);
  if (!pictures.ok()) return pictures.error();
  Problem problem;
  problem.panels = std::move(pictures->panels);
  problem.artworks = std::move(pictures->artworks);
  problem.warnings = std::move(pictures->warnings);

  const auto all_turns = turns(options.rotations);
  std::vector<Problem::Task> tasks;
  std::vector<double> urgency;
  for (std::size_t a = 0; a < artworks.size(); ++a) {
    WorkingArtwork& work = problem.artworks[a];
    work.patches = grid_layout(artworks[a].width, artworks[a].height, options.patch);
    std::vector<MatchPatch> patches;
    for (const Patch& patch : work.patches)
      patches.push_back({patch_pixels(patch.outline, work.grid, work.features.cols, work.features.rows), patch.outline,
                         &work.features, work.grid, 0});
    const WindowClass windows = common_class(patches);
    if (std::min(windows.width, windows.height) < kSmallestPatch)
      return unusable(
          fmt::format("a patch of \"{}\" has only {} x {} pixels at {} dpi: choose larger patches or a finer "
                      "working resolution",
                      artworks[a].name, windows.width, windows.height, options.dpi));
    if (!fits_somewhere(work.patches.front().outline, problem, all_turns)) {
      const Box<ArtworkFrame> box = bounds(work.patches.front().outline);
      return unusable(fmt::format("the patches of \"{}\" ({:.1f} x {:.1f} mm) are larger than every panel",
                                  artworks[a].name, box.width().count(), box.height().count()));
    }
    const std::size_t index = class_index(problem.classes, windows);
    const auto urgent = urgencies(artworks[a], work.patches, options.priority);
    const auto important = importances(artworks[a], work.patches);
    for (std::size_t p = 0; p < patches.size(); ++p) {
      patches[p].window_class = index;
      tasks.push_back({a, p, std::move(patches[p]), important[p]});
    }
    if (!options.interleave) {
      for (const std::size_t i : by_urgency(urgent)) problem.queue.push_back(std::move(tasks[i]));
      tasks.clear();
    }
    urgency.insert(urgency.end(), urgent.begin(), urgent.end());
  }
  if (options.interleave)
    for (const std::size_t i : by_urgency(urgency)) problem.queue.push_back(std::move(tasks[i]));

  problem.entries_per_unit = (kernels::kLargestEntry - 1) / largest_response(options);
  return problem;
}

}  // namespace veneer::planner
