#include "planner/suggest/picture_sketch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "planner/cancelled.h"
#include "planner/cutting/cut_drawing.h"
#include "planner/files/preview.h"
#include "planner/layout/grid.h"
#include "planner/suggest/mosaic_sketch.h"
#include "planner/suggest/suggestions.h"

namespace veneer::planner {
namespace {

// How finely wood is looked at: pixels of a patch's side, and rotations. The finest that is quick enough.
struct SketchEffort {
  double patch_pixels;
  int rotations;
};
constexpr std::array kSketchEfforts{SketchEffort{9, 4}, SketchEffort{9, 2}, SketchEffort{7, 2}, SketchEffort{6, 1}};
constexpr double kMostLooks = 2e8;                    // places times patches, some nanosecond each
constexpr double kCoarsestDpi = 10, kFinestDpi = 75;  // that wood is chosen at; make_plan takes no coarser
constexpr double kSketchThoroughness = 1.0 / 12;
constexpr double kFinerShapes = 1.5;  // so much finer is wood looked at for other shapes than squares
constexpr int kMostPatches = 1200;
constexpr double kLongestPreview = 960;  // pixels of a preview

SketchEffort affordable(std::span<const StockPanel> stock, double patches, Millimetres patch) {
  double wood = 0;  // in patches
  for (const StockPanel& panel : stock)
    wood += panel.picture.width().count() * panel.picture.height().count() / (patch.count() * patch.count());
  for (const SketchEffort& it : kSketchEfforts)
    if (wood * it.patch_pixels * it.patch_pixels * it.rotations * patches <= kMostLooks) return it;
  return kSketchEfforts.back();
}

PlanOptions sketch_options(const PlanOptions& wanted, const Artwork& artwork, std::span<const StockPanel> stock,
                           GridEffort effort) {
  PlanOptions out = wanted;
  const double area = artwork.width.count() * artwork.height.count();
  out.patch = std::max(wanted.patch, Millimetres(std::sqrt(area / kMostPatches)));
  const SketchEffort looks = affordable(stock, area / (out.patch.count() * out.patch.count()), out.patch);
  out.dpi = std::clamp(ScanResolution{looks.patch_pixels / out.patch.count()}.dpi(), kCoarsestDpi, kFinestDpi);
  if (effort == GridEffort::kCoarse) {
    out.layout = LayoutKind::kGrid, out.triangles = false, out.refine = Refine::kNone;
  } else {
    out.layout_fineness = rough_fineness(area / (out.patch.count() * out.patch.count()));
    if (out.layout != LayoutKind::kGrid || out.refine != Refine::kNone)
      out.dpi = std::min(out.dpi * kFinerShapes, kFinestDpi);
  }
  out.rotations = std::min(wanted.rotations, looks.rotations);
  out.thoroughness = kSketchThoroughness;
  out.exact = false, out.fine_rotation = false, out.optimize = Optimize::kGreedy;
  out.rematch = 0, out.adaptive_levels = 0, out.alternatives = 0;
  out.index_cache.clear(), out.kept.clear(), out.kept_layouts.clear();
  return out;
}

// Vertices are pinned in a grid, and larger patches make another.
Status keeps_pins(const Artwork& artwork, Millimetres wanted, Millimetres drawn) {
  const GridSize asked = grid_size(artwork.width, artwork.height, wanted),
                 made = grid_size(artwork.width, artwork.height, drawn);
  if (artwork.guides.vertices.empty() || (asked.rows == made.rows && asked.columns == made.columns)) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("a sketch has some {} pieces at most, and the pinned vertices belong to a grid of {}: free "
                           "them or choose larger pieces to see one; a plan takes them as they are",
                           kMostPatches, static_cast<std::int64_t>(asked.rows) * asked.columns)};
}

}  // namespace

Result<PictureSketch> sketch_picture(const Artwork& artwork, std::span<const StockPanel> stock,
                                     const PlanOptions& wanted, GridEffort effort, const std::stop_token& stop) {
  const PlanOptions options = sketch_options(wanted, artwork, stock, effort);
  if (options.layout == LayoutKind::kMorph)
    if (const Status kept = keeps_pins(artwork, wanted.patch, options.patch); !kept.ok()) return kept.error();
  Result<Plan> plan = make_plan({&artwork, 1}, stock, options, {}, stop);
  if (!plan.ok()) return plan.error();
  const double longer = std::max(artwork.width, artwork.height).count();
  const ScanResolution drawn{std::min(ScanResolution::from_dpi(kSketchDpi).px_per_mm, kLongestPreview / longer)};
  const Result<Raster<ArtworkFrame>> preview = assemble_preview(*plan, 0, stock, drawn);
  if (!preview.ok()) return preview.error();
  if (stop.stop_requested()) return cancelled();
  PictureSketch out;
  out.layout = options.layout, out.patch = options.patch;
  out.preview = preview->pixels;
  out.likeness = likeness(out.preview, artwork.picture);
  if (const std::size_t missing = unfilled(*plan); missing > 0)
    out.remarks.push_back(
        fmt::format("the free wood is short: {} of {} pieces find none; make the picture smaller, "
                    "allow more wood or add a panel",
                    missing, plan->pieces.size()));
  if (options.patch > wanted.patch) {
    out.remarks.push_back(fmt::format("drawn in pieces of {:.1f} mm: smaller ones would take too long for a sketch",
                                      options.patch.count()));
  } else {
    out.cutting = std::chrono::duration<double>(0);
    for (const PlanPanel& panel : plan->panels) {
      const auto estimate = quick_estimate(*plan, panel);
      if (!estimate.ok()) return estimate.error();
      *out.cutting += *estimate;
    }
  }
  out.plan = std::move(*plan);
  return out;
}

}  // namespace veneer::planner
