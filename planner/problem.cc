#include "planner/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "planner/features.h"
#include "planner/histogram.h"
#include "planner/kernels.h"
#include "planner/order.h"
#include "planner/resample.h"

namespace veneer::planner {
namespace {

constexpr int kSmallestPatch = 3;  // working pixels

Error unusable(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message)}; }

bool within(double value, double low, double high) { return value >= low && value <= high; }  // false for NaN

Status check_options(const PlanOptions& o) {
  if (!within(o.w_intensity, 0, 1)) return unusable("the intensity weight must lie between 0 and 1");
  if (!within(o.w_edge, 0, 1)) return unusable("the edge weight must lie between 0 and 1");
  if (!within(o.w_hist, 0, 1)) return unusable("the histogram weight must lie between 0 and 1");
  if (o.w_intensity == 0 && o.w_edge == 0) return unusable("the intensity weight and the edge weight are both 0");
  if (!within(o.patch.count(), 0.1, 10000)) return unusable("the patch size must lie between 0.1 and 10000 mm");
  if (!within(o.dpi, 10, 2400)) return unusable("the working resolution must lie between 10 and 2400 dpi");
  if (!within(o.rotations, 1, 360)) return unusable("the number of rotations must lie between 1 and 360");
  if (!within(o.kerf.count(), 0, 10)) return unusable("the kerf must lie between 0 and 10 mm");
  if (!within(o.position_margin.count(), 0, 100)) return unusable("the position margin must lie between 0 and 100 mm");
  if (o.threads < 0) return unusable("the number of threads must not be negative");
  return Ok();
}

Status check_artwork(const Artwork& artwork, const PlanOptions& options) {
  const cv::Mat& picture = artwork.picture;
  if (picture.empty()) return unusable(fmt::format("the picture \"{}\" is empty", artwork.name));
  if (picture.type() != CV_8UC3) return unusable(fmt::format("the picture \"{}\" is not 8-bit colour", artwork.name));
  if (picture.cols < 2 || picture.rows < 2)
    return unusable(fmt::format("the picture \"{}\" has only {} x {} pixels: there is nothing to rebuild", artwork.name,
                                picture.cols, picture.rows));
  if (!within(artwork.width.count(), 0.1, 1e5) || !within(artwork.height.count(), 0.1, 1e5))
    return unusable(fmt::format("the size of \"{}\" must lie between 0.1 mm and 100 m", artwork.name));
  const double pixels = options.dpi / 25.4 * options.dpi / 25.4 * artwork.width.count() * artwork.height.count();
  if (pixels > 4e8)
    return unusable(
        fmt::format("\"{}\" would have {:.0f} million pixels at {} dpi: make it smaller or choose a coarser "
                    "working resolution",
                    artwork.name, pixels / 1e6, options.dpi));
  return Ok();
}

Status check_panel(const StockPanel& panel) {
  const std::string& name = panel.id.value;
  if (panel.picture.pixels.empty()) return unusable(fmt::format("panel {} has no picture", name));
  if (panel.picture.pixels.type() != CV_8UC3)
    return unusable(fmt::format("the picture of panel {} is not 8-bit colour", name));
  if (panel.free.pixels.empty() || panel.free.pixels.type() != CV_8UC1)
    return unusable(fmt::format("panel {} has no mask of free wood", name));
  if (!within(panel.picture.resolution.dpi(), 1, 10000) || !within(panel.free.resolution.dpi(), 1, 10000))
    return unusable(fmt::format("the resolution of panel {} must lie between 1 and 10000 dpi", name));
  return Ok();
}

// The stock raster, free only where the whole pixel lies on the picture, and reaching at least as far as the picture.
Raster<PanelFrame> usable_wood(const Raster<PanelFrame>& free, const Raster<PanelFrame>& picture) {
  double left = 0, bottom = 0, right = 0, top = 0;
  free.to_pixels(picture.origin, left, bottom);
  free.to_pixels({picture.origin.x + picture.width(), picture.origin.y + picture.height()}, right, top);
  const auto beyond = [](double by) { return std::max(0, static_cast<int>(std::ceil(by - 1e-6))); };
  const int pad_left = beyond(-left), pad_top = beyond(-top);
  const int pad_right = beyond(right - free.pixels.cols), pad_bottom = beyond(bottom - free.pixels.rows);
  Raster<PanelFrame> out = free;
  cv::copyMakeBorder(free.pixels, out.pixels, pad_top, pad_bottom, pad_left, pad_right, cv::BORDER_CONSTANT, 0);
  out.origin = {free.origin.x - free.resolution.to_mm(Pixels(pad_left)),
                free.origin.y - free.resolution.to_mm(Pixels(pad_bottom))};
  const int first_column = static_cast<int>(std::ceil(left - 1e-6)) + pad_left;
  const int first_row = static_cast<int>(std::ceil(top - 1e-6)) + pad_top;
  const int last_column = static_cast<int>(std::floor(right + 1e-6)) + pad_left;
  const int last_row = static_cast<int>(std::floor(bottom + 1e-6)) + pad_top;
  cv::Mat keep(out.pixels.size(), CV_8UC1, cv::Scalar(0));
  const cv::Rect inside = cv::Rect(cv::Point(first_column, first_row), cv::Point(last_column, last_row)) &
                          cv::Rect(0, 0, keep.cols, keep.rows);
  if (inside.area() > 0) keep(inside).setTo(255);
  out.pixels.setTo(0, keep == 0);
  return out;
}

// For every pixel of `like` whether its centre is free.
cv::Mat free_mask_like(const Raster<PanelFrame>& like, const Raster<PanelFrame>& free) {
  cv::Mat mask(like.pixels.size(), CV_8UC1, cv::Scalar(0));
  for (int r = 0; r < mask.rows; ++r) {
    auto* to = mask.ptr<std::uint8_t>(r);
    for (int c = 0; c < mask.cols; ++c) {
      double column = 0, row = 0;
      free.to_pixels(like.from_pixels(c + 0.5, r + 0.5), column, row);
      if (column < 0 || row < 0 || column >= free.pixels.cols || row >= free.pixels.rows) continue;
      to[c] = free.pixels.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column));
    }
  }
  return mask;
}

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

Status add_panels(std::span<const StockPanel> stock, const PlanOptions& options, Problem& problem,
                  GreyHistogram& tones) {
  const ScanResolution resolution = ScanResolution::from_dpi(options.dpi);
  for (const StockPanel& panel : stock) {
    const Raster<PanelFrame> picture = at_resolution(panel.picture, resolution);
    const Raster<PanelFrame> free = usable_wood(panel.free, picture);
    const cv::Mat grey = grey_of(picture.pixels);
    tones.add(grey, free_mask_like(picture, free));
    Raster<PanelFrame> features = picture;
    features.pixels = filter_bank(grey, grey, options);
    problem.panels.push_back({std::move(features), FreeWood(free, options.kerf, options.position_margin)});
  }
  if (tones.total() <= 0) return unusable("no panel has any free wood: every mask is empty");
  return Ok();
}

WorkingArtwork working_artwork(const Artwork& artwork, const PlanOptions& options, const GreyHistogram& tones) {
  const ScanResolution resolution = ScanResolution::from_dpi(options.dpi);
  WorkingArtwork out;
  out.grid = {resolution, artwork.height};
  const cv::Mat grey = grey_of(
      stretch(artwork.picture, working_pixels(artwork.width, resolution), working_pixels(artwork.height, resolution)));
  out.features = filter_bank(match_tones(grey, tones, options.w_hist), grey, options);
  out.patches = grid_layout(artwork.width, artwork.height, options.patch);
  return out;
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

Status check_input(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options) {
  if (artworks.empty()) return unusable("there is no picture to plan");
  if (stock.empty()) return unusable("there is no panel to plan with");
  if (Status status = check_options(options); !status.ok()) return status;
  for (const Artwork& artwork : artworks)
    if (Status status = check_artwork(artwork, options); !status.ok()) return status;
  for (const StockPanel& panel : stock)
    if (Status status = check_panel(panel); !status.ok()) return status;
  return Ok();
}

Result<Problem> make_problem(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                             const PlanOptions& options) {
  if (Status status = check_input(artworks, stock, options); !status.ok()) return status.error();
  Problem problem;
  GreyHistogram tones;
  if (Status status = add_panels(stock, options, problem, tones); !status.ok()) return status.error();

  const auto all_turns = turns(options.rotations);
  std::vector<Problem::Task> tasks;
  std::vector<double> urgency;
  problem.artworks.reserve(artworks.size());  // tasks point into it
  for (std::size_t a = 0; a < artworks.size(); ++a) {
    const WorkingArtwork& work = problem.artworks.emplace_back(working_artwork(artworks[a], options, tones));
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
    urgency.insert(urgency.end(), urgent.begin(), urgent.end());
    for (std::size_t p = 0; p < patches.size(); ++p) {
      patches[p].window_class = index;
      tasks.push_back({a, p, std::move(patches[p])});
    }
  }
  for (const std::size_t i : by_urgency(urgency)) problem.queue.push_back(std::move(tasks[i]));

  problem.entries_per_unit = (kernels::kLargestEntry - 1) / largest_response(options);
  return problem;
}

}  // namespace veneer::planner
