// What make_plan refuses before it starts, each in one sentence.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planner/layout/grid.h"
#include "planner/pictures/features.h"
#include "planner/plan_options.h"
#include "planner/problem/problem.h"

namespace veneer::planner {
namespace {

bool within(double value, double low, double high) { return value >= low && value <= high; }  // false for NaN

}  // namespace

Status check_options(const PlanOptions& o) {
  if (Status status = check_weights(o); !status.ok()) return status;
  if (!within(o.w_hist, 0, 1)) return unusable("the histogram weight must lie between 0 and 1");
  if (!within(o.w_range, 0, 1)) return unusable("the range weight must lie between 0 and 1");
  if (!within(o.w_detail, 0, 1)) return unusable("the detail weight must lie between 0 and 1");
  if (!within(o.w_gamut, 0, 1)) return unusable("the gamut weight must lie between 0 and 1");
  if (!within(o.w_grain, 0, 1)) return unusable("the grain weight must lie between 0 and 1");
  if (!within(o.edge.count(), 0, 50)) return unusable("the scale of edges must lie between 0 and 50 mm");
  if (!within(o.patch.count(), 0.1, 10000)) return unusable("the patch size must lie between 0.1 and 10000 mm");
  if (!within(o.adaptive_levels, 0, 6)) return unusable("the number of adaptive levels must lie between 0 and 6");
  if (!within(o.adaptive_factor, 0, 1e6)) return unusable("the adaptive factor must not be negative");
  if (!within(o.dpi, 10, 2400)) return unusable("the working resolution must lie between 10 and 2400 dpi");
  if (!within(o.rotations, 1, 360)) return unusable("the number of rotations must lie between 1 and 360");
  if (!within(o.thoroughness, 1e-3, 1)) return unusable("the thoroughness must lie between 0.001 and 1");
  if (!within(o.layout_fineness, 1e-3, 1)) return unusable("the fineness of layouts must lie between 0.001 and 1");
  if (!within(o.kerf.count(), 0, 10)) return unusable("the kerf must lie between 0 and 10 mm");
  if (!within(o.position_margin.count(), 0, 100)) return unusable("the position margin must lie between 0 and 100 mm");
  if (!within(o.web.count(), 0, 10)) return unusable("the web between pieces must lie between 0 and 10 mm");
  if (!within(o.reserve, 0, 1)) return unusable("the share of patches with reserved wood must lie between 0 and 1");
  if (!within(o.optimize_seconds, 0, 1e9))
    return unusable("the seconds of the optimisation must lie between 0 and 1e9");
  if (!within(o.overlap.count(), 0, 1000))
    return unusable("the overlap of refined pieces must lie between 0 and 1000 mm");
  if (!within(o.min_width.count(), 0.1, 100))
    return unusable("the least width of refined pieces must lie between 0.1 and 100 mm");
  if (!within(o.min_size.count(), 0, 1000)) return unusable("the least size of pieces must lie between 0 and 1000 mm");
  if (!within(o.rematch, 0, 100)) return unusable("wood can be chosen again for refined pieces from 0 to 100 times");
  if (!within(o.cell_aspect, 1, 4)) return unusable("cells must be from 1 to 4 times as long as wide");
  // Others would be merged away, one after the other.
  if (const double narrow = o.patch.count() / std::sqrt(o.cell_aspect);
      o.layout == LayoutKind::kMosaic && o.cell_aspect > 1 && narrow < o.min_width.count())
    return unusable(fmt::format(
        "cells of {} mm that are {} times as long as wide are {:.1f} mm wide, and no part of a piece may be "
        "narrower than {} mm: raise --patch-mm, or lower --cell-aspect",
        o.patch.count(), o.cell_aspect, narrow, o.min_width.count()));
  if (o.layout != LayoutKind::kGrid && o.adaptive_levels > 0)
    return unusable("only a grid has adaptive levels: leave them at 0, or choose the layout grid");
  if (o.refine != Refine::kNone && !o.kept.empty())
    return unusable(
        "a plan whose pieces are kept keeps its borders too: refine the picture anew, or keep the plan without refine");
  if (o.refine != Refine::kNone && o.alternatives > 0)
    return unusable(
        "alternatives are listed for shapes that are final: refine first, then keep that plan and ask for "
        "alternatives");
  if (o.material_limits.size() > LimitSet::kMost)
    return unusable(fmt::format("at most {} materials can have limits: leave some out", LimitSet::kMost));
  for (std::size_t i = 0; i < o.material_limits.size(); ++i) {
    const MaterialLimit& it = o.material_limits[i];
    if (!within(it.share, 0, 1))
      return unusable(
          fmt::format("the limit of {} must lie between 0 and 1: a share of the pictures' area", it.material));
    for (std::size_t k = 0; k < i; ++k)
      if (o.material_limits[k].material == it.material)
        return unusable(fmt::format("{} has two limits: give it one", it.material));
  }
  if (!o.material_limits.empty() && o.adaptive_levels > 0)
    return unusable("limits of materials do not go with adaptive levels: leave one of them out");
  if (!o.material_limits.empty() && o.refine != Refine::kNone)
    return unusable(
        "limits of materials do not go with refined borders, whose pieces of the better wood grow: leave one of them "
        "out");
  if (o.alternatives > 1000) return unusable("the number of alternatives must lie between 0 and 1000");
  if (o.threads < 0) return unusable("the number of threads must not be negative");
  return Ok();
}

Status check_artwork(const Artwork& artwork, const PlanOptions& options) {
  const cv::Mat& picture = artwork.picture;
  if (picture.empty()) return unusable(fmt::format("the picture \"{}\" is empty", artwork.name));
  if (picture.type() != CV_8UC3) return unusable(fmt::format("the picture \"{}\" is not 8-bit colour", artwork.name));
  if (picture.cols < 2 || picture.rows < 2)
    return unusable(
        fmt::format("the picture \"{}\" has only {} x {} pixels, so there is nothing to rebuild: choose another",
                    artwork.name, picture.cols, picture.rows));
  if (!within(artwork.width.count(), 0.1, 1e5) || !within(artwork.height.count(), 0.1, 1e5))
    return unusable(fmt::format("the size of \"{}\" must lie between 0.1 mm and 100 m", artwork.name));
  if (!artwork.importance.empty() && artwork.importance.type() != CV_8UC1)
    return unusable(fmt::format("the importance of \"{}\" is not an 8-bit grey picture", artwork.name));
  if (!artwork.segmentation.empty() && artwork.segmentation.type() != CV_8UC3)
    return unusable(fmt::format("the segmentation of \"{}\" is not 8-bit colour", artwork.name));
  if (options.layout != LayoutKind::kMorph && artwork.guides.guide_a_grid())
    return unusable(
        fmt::format("only a morphed grid heeds guides, and \"{}\" has some: choose the layout morph", artwork.name));
  if (options.layout != LayoutKind::kMosaic && artwork.guides.guide_a_mosaic())
    return unusable(
        fmt::format("only a mosaic heeds sizes of cells and flow lines, and \"{}\" has some: choose the layout mosaic",
                    artwork.name));
  if (options.layout == LayoutKind::kMosaic && options.flow_lines_only && artwork.guides.flow_lines.empty())
    return unusable(fmt::format(
        "cells are to lie along flow lines alone, and \"{}\" has none: draw some, or let them lie along its edges",
        artwork.name));
  if (Status status = check_cell_sizes(artwork.guides.cell_sizes, picture.size(), artwork.name); !status.ok())
    return status;
  // As none would be heeded: they were drawn for another part of it, or beside it.
  if (!artwork.guides.flow_lines.empty() && std::ranges::none_of(artwork.guides.flow_lines, meets_picture))
    return unusable(fmt::format(
        "no flow line of \"{}\" runs over it: draw some where cells are to lie along them, or leave them out",
        artwork.name));
  for (const cv::Mat& mask : {artwork.guides.large, artwork.guides.fine})
    if (!mask.empty() && mask.type() != CV_8UC1)
      return unusable(fmt::format("the edges that count of \"{}\" are not an 8-bit grey picture", artwork.name));
  const double pixels = options.dpi / 25.4 * options.dpi / 25.4 * artwork.width.count() * artwork.height.count();
  if (pixels > 4e8)
    return unusable(
        fmt::format("\"{}\" would have {:.0f} million pixels at {} dpi: make it smaller or choose a coarser "
                    "working resolution",
                    artwork.name, pixels / 1e6, options.dpi));
  return Ok();
}

namespace {

// What would fail later, after all pixels have been looked at.
Status check_patches(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options) {
  constexpr double kMostPatches = 1e6;  // some hundred bytes each, while the paper's pictures have a thousand
  const GridSize grid = grid_size(artwork.width, artwork.height, options.patch);
  const double patches = static_cast<double>(grid.rows) * grid.columns;
  if (patches > kMostPatches)
    return unusable(fmt::format("\"{}\" would have {:.0f} million patches: choose larger ones or make it smaller",
                                artwork.name, std::ceil(patches / 1e6)));
  const Millimetres width = artwork.width / grid.columns, height = artwork.height / grid.rows;
  const ScanResolution resolution = ScanResolution::from_dpi(options.dpi);
  const auto pixels = [&](Millimetres side) { return std::ceil(resolution.to_px(side).count()); };  // at most
  if (std::min(pixels(width), pixels(height)) < kSmallestPatch)
    return unusable(
        fmt::format("a patch of \"{}\" has only {} x {} pixels at {} dpi: choose larger patches or a finer "
                    "working resolution",
                    artwork.name, pixels(width), pixels(height), options.dpi));
  // Areas that somebody drew are as large as they are: each is held against the panels once it is known.
  if (options.layout == LayoutKind::kSegmentation && !artwork.segmentation.empty()) return Ok();
  const Millimetres margin = (options.kerf_and_web() + options.margin_and_web()) * 2;
  const auto all_turns = turns(options.rotations);
  const bool fit = std::any_of(stock.begin(), stock.end(), [&](const StockPanel& panel) {
    return fits(width + margin, height + margin, panel.picture.width(), panel.picture.height(), all_turns);
  });
  if (!fit)
    return unusable(
        fmt::format("the patches of \"{}\" ({:.1f} x {:.1f} mm) are larger than every panel: choose smaller "
                    "ones or add a panel",
                    artwork.name, width.count(), height.count()));
  return Ok();
}

Status check_panel(const StockPanel& panel) {
  const std::string& name = panel.id.value;
  if (panel.picture.pixels.empty()) return unusable(fmt::format("panel {} has no picture", name));
  if (panel.picture.pixels.cols < 2 || panel.picture.pixels.rows < 2)
    return unusable(fmt::format("the picture of panel {} has only {} x {} pixels: choose another", name,
                                panel.picture.pixels.cols, panel.picture.pixels.rows));
  if (panel.picture.pixels.type() != CV_8UC3)
    return unusable(fmt::format("the picture of panel {} is not 8-bit colour", name));
  if (!within(panel.tone_weight, 0, 1000))
    return unusable(fmt::format("the tone weight of panel {} must lie between 0 and 1000", name));
  if (!std::all_of(panel.zones.begin(), panel.zones.end(),
                   [](const WoodZone& zone) { return within(zone.tone_weight, 0, 1000); }))
    return unusable(fmt::format("the tone weights of panel {}'s woods must lie between 0 and 1000", name));
  if (panel.free.pixels.empty() || panel.free.pixels.type() != CV_8UC1)
    return unusable(fmt::format("panel {} has no mask of free wood", name));
  if (!panel.open.pixels.empty() &&
      (panel.open.pixels.size() != panel.free.pixels.size() || panel.open.pixels.type() != CV_8UC1))
    return unusable(fmt::format("the wood of panel {} that is left is not on the pixels of its free wood", name));
  if (!within(panel.picture.resolution.dpi(), 1, 10000) || !within(panel.free.resolution.dpi(), 1, 10000))
    return unusable(fmt::format("the resolution of panel {} must lie between 1 and 10000 dpi", name));
  return Ok();
}

}  // namespace

Status check_input(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options) {
  if (artworks.empty()) return unusable("there is no picture to plan");
  if (stock.empty()) return unusable("there is no panel to plan with");
  if (Status status = check_options(options); !status.ok()) return status;
  for (const Artwork& artwork : artworks)
    if (Status status = check_artwork(artwork, options); !status.ok()) return status;
  for (const StockPanel& panel : stock)
    if (Status status = check_panel(panel); !status.ok()) return status;
  for (const Artwork& artwork : artworks)
    if (Status status = check_patches(artwork, stock, options); !status.ok()) return status;
  return Ok();
}

}  // namespace veneer::planner
